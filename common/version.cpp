#include "common/version.h"

namespace clamor {

const char* const kVersion = CLAMOR_VERSION_TEXT;

}  // namespace clamor
