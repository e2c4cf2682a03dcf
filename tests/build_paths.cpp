#include "tests/build_paths.h"

namespace clamor::testing {

const char kSourceDir[] = CLAMOR_SOURCE_DIR;
const char kProgram[] = CLAMOR_PROGRAM;
const char kJackListener[] = CLAMOR_JACK_LISTENER;

std::string shared_level(const std::string& name) {
  return std::string(kSourceDir) + "/../shared/levels/" + name;
}

std::string shared_case(const std::string& name) {
  return std::string(kSourceDir) + "/../shared/cases/" + name;
}

}  // namespace clamor::testing
