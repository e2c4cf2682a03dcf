// atomic_file.h: a file that appears complete or not at all.
//
// Written under a temporary name in the same folder, synced, renamed, the folder synced: a crash or
// a full disk at any moment leaves the old file or none, never half of one.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "common/result.h"

namespace clamor {

class AtomicFile {
 public:
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&& other) noexcept;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();  // removes the temporary unless commit() succeeded

  const std::string& path() const { return path_; }  // that it will have
  const std::string& temporary_path() const { return temporary_; }

  Result<void> write(std::span<const std::byte> bytes);
  Result<void> write_at(std::size_t offset, std::span<const std::byte> bytes);

  // Syncs and renames. Call once, last.
  Result<void> commit();

 private:
  AtomicFile(std::string path, std::string temporary, int descriptor);

  std::string path_, temporary_;
  int descriptor_ = -1;
};

}  // namespace clamor
