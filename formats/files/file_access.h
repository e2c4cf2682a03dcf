// file_access.h: how a bake file is opened, and how one version of a file is told from the next.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace clamor {

// kMap installs a handler for SIGBUS in the process (bus_error_guard.h), so it is for programs, and
// for a library only where its caller allows it. kRead copies what it needs with pread().
enum class FileAccess : std::uint8_t { kRead, kMap };

struct FileVersion {
  std::uint64_t device = 0, inode = 0, bytes = 0;
  std::int64_t modified_ns = 0;

  bool operator==(const FileVersion&) const = default;
  bool is_same_file(const FileVersion& other) const {
    return device == other.device && inode == other.inode;
  }
};

// The version that stands under this name now; none if there is no regular file.
std::optional<FileVersion> file_version(const std::string& path);

}  // namespace clamor
