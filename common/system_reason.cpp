#include "common/system_reason.h"

#include <cerrno>
#include <cstring>
#include <system_error>

namespace clamor {

namespace {

const char* limit_in_words(int code) {
  if (code == EMFILE)
    return ": this process has as many files open as it may; raise the limit with ulimit -n";
  if (code == ENFILE) return ": all programs together have as many files open as the system may";
  if (code == EAGAIN)
    return ": no more threads or processes can be had; raise the limit with ulimit -u, or that of "
           "the container";
  return "";
}

}  // namespace

std::string system_reason(int code) {
  return std::strerror(code) + std::string(limit_in_words(code));
}

std::string system_reason(const std::exception& thrown) {
  const auto* const refused = dynamic_cast<const std::system_error*>(&thrown);
  if (refused == nullptr) return thrown.what();
  const std::string limit = limit_in_words(refused->code().value());
  return limit.empty() ? thrown.what() : system_reason(refused->code().value());
}

}  // namespace clamor
