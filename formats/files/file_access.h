// file_access.h: access mode and version of a file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace clamor {

// kMap installs a SIGBUS handler in the process (bus_error_guard.h), so a library may use it only
// with the consent of its caller. kRead copies ranges with pread().
enum class FileAccess : std::uint8_t { kRead, kMap };

struct FileVersion {
  std::uint64_t device = 0, inode = 0, bytes = 0;
  std::int64_t modified_ns = 0;

  bool operator==(const FileVersion&) const = default;
  bool is_same_file(const FileVersion& other) const {
    return device == other.device && inode == other.inode;
  }
};

// Current version of the file at `path`; none if it is no regular file.
std::optional<FileVersion> file_version(const std::string& path);

}  // namespace clamor
