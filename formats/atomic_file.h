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

  // Syncs, renames and syncs the folder. Call once, last. Once it is renamed the file is in its
  // place, whole and on the disk, and nothing that follows is an error.
  Result<void> commit();

 private:
  AtomicFile(std::string path, std::string temporary, int descriptor);

  std::string path_, temporary_;
  int descriptor_ = -1;
};

// So that a new name survives a power cut. Some file systems cannot do that, and the file is no
// worse for it: whether it worked is not told.
void sync_folder_of(const std::string& path);

}  // namespace clamor
