// file_access.h: how the bytes of a file are read.
#pragma once

#include <cstdint>

namespace clamor {

// kMap installs a SIGBUS handler in the process (bus_error_guard.h), so a library may use it only
// with the consent of its caller. kRead copies ranges with pread().
enum class FileAccess : std::uint8_t { kRead, kMap };

}  // namespace clamor
