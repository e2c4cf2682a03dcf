// atomic_file.h: a file that appears complete or not at all.
//
// Written under a temporary name in the same folder, synced, renamed, the folder synced: a crash or
// a full disk at any moment leaves the old file or none, never half of one. Temporaries that killed
// processes left behind go when the same file is written again.
//
// A path that leads through symbolic links writes the file at their end. A stream (output_target.h)
// cannot be renamed: its temporary lies in the system's folder for temporary files and is copied
// into the stream once it is complete.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "common/result.h"
#include "formats/files/output_target.h"

namespace clamor {

class AtomicFile {
 public:
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&& other) noexcept;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();  // removes the temporary unless commit() succeeded

  const std::string& path() const { return path_; }  // as the user named it
  bool is_stream() const { return target_.is_stream(); }
  int descriptor() const { return descriptor_; }  // for libraries that write by themselves

  Result<void> write(std::span<const std::byte> bytes);
  Result<void> write_at(std::size_t offset, std::span<const std::byte> bytes);

  // For recordings, which are worth something before they are complete: puts what has been written
  // into its place now, where it grows with every further write. Nothing removes it then. A stream
  // takes no write_at() any more.
  Result<void> appear();

  // Syncs, renames and syncs the folder. Call once, last. Once it is renamed the file is in its
  // place, whole and on the disk, and nothing that follows is an error.
  Result<void> commit();

 private:
  AtomicFile(std::string path, OutputTarget target, std::string temporary, int descriptor);
  Result<void> copy_to_stream();

  std::string path_;
  OutputTarget target_;
  std::string temporary_;  // "" where it has no name, or no longer
  int descriptor_ = -1;
  bool has_appeared_ = false;
};

// So that a new name survives a power cut. Some file systems cannot do that, and the file is no
// worse for it: whether it worked is not told.
void sync_folder_of(const std::string& path);

}  // namespace clamor
