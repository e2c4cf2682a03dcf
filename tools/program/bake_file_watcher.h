// bake_file_watcher.h: notices that a bake file was replaced or overwritten while it plays.
//
// The file under the path is compared with the one that was opened: device, inode, size and time of
// the last change. A change counts when two checks in a row see the same version, so that a copy
// that is still being written is ignored. A deleted file is no change.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "formats/bake_file/bake_file.h"

namespace clamor {

class BakeFileWatcher {
 public:
  // kReplaced: another file has the path, and the open one is intact. kOverwritten: the open file
  // itself has changed.
  enum class Change { kNone, kReplaced, kOverwritten };

  explicit BakeFileWatcher(const BakeFile& playing)
      : path_(playing.path()), playing_(playing.version()), reported_(playing_), seen_(playing_) {}

  // Checks the file system, which may block. Reports each version once.
  Change check() {
    const std::optional<FileVersion> now = file_version(path_);
    const bool is_settled = now == std::exchange(seen_, now);
    if (!now || !is_settled || *now == reported_) return Change::kNone;
    reported_ = *now;
    if (*now == playing_) return Change::kNone;
    return now->is_same_file(playing_) ? Change::kOverwritten : Change::kReplaced;
  }

  // Sets the file that plays from now on, opened under the original path.
  void plays(const BakeFile& file) { seen_ = reported_ = playing_ = file.version(); }

 private:
  const std::string path_;
  FileVersion playing_, reported_;
  std::optional<FileVersion> seen_;  // at the last check
};

}  // namespace clamor
