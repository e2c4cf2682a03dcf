// atomic_file.h: writes a file atomically: it appears complete or not at all.
//
// The file is written under a temporary name in the same folder, synced and renamed, and the folder
// is synced: a crash or a full disk at any moment leaves the old file or none, never half of one.
// Writing the same file again removes temporaries that killed processes left behind.
//
// Symbolic links are followed to the file at their end. A stream (output_target.h) cannot be
// renamed: its temporary lies in the system's folder for temporary files and is copied to the
// stream once complete.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "common/platform/system_file.h"
#include "common/result.h"
#include "formats/files/byte_sink.h"
#include "formats/files/output_target.h"

namespace clamor {

class AtomicFile final : public ByteSink {
 public:
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&& other) noexcept = default;
  AtomicFile& operator=(AtomicFile&& other) noexcept;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile() override;  // removes the temporary unless committed

  const std::string& path() const override { return path_; }  // as given to create()
  bool is_stream() const { return target_.is_stream(); }

  Result<void> write(std::span<const std::byte> bytes) override;
  Result<void> write_at(std::size_t offset, std::span<const std::byte> bytes) override;

  // Moves the file to its final name before it is complete, for recordings: it then grows in place
  // with every write, and nothing removes it. A stream accepts no write_at() from then on.
  Result<void> appear();

  // Syncs the file, renames it and syncs the folder. Call once, last. After the rename the file is
  // complete and on disk, so a failure to sync the folder is not an error.
  Result<void> commit();

 private:
  AtomicFile(std::string path, OutputTarget target, std::string temporary, SystemFile file);
  Result<void> copy_to_stream();

  std::string path_;
  OutputTarget target_;
  std::string temporary_;  // empty if it has no name (any more)
  SystemFile file_;
  bool has_appeared_ = false;
};

// Writes a file that holds this text.
Result<void> write_file(const std::string& path, std::string_view text);

// Makes a new name in the folder of `path` survive a power cut, where the file system supports it.
// Failures are ignored.
void sync_folder_of(const std::string& path);

}  // namespace clamor
