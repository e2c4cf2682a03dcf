// bake_file_watcher.h: notices that a bake file was replaced or overwritten while it plays.
//
// It asks the file system what stands under the file's name, and compares that with what was
// opened: device, inode, size and time of the last change. News counts when two looks in a row see
// it, so that a copy that is still being written is left alone. A file that is only gone is no
// news.
#pragma once

#include <optional>
#include <string>

#include "formats/bake_file/bake_file.h"

namespace clamor {

class BakeFileWatcher {
 public:
  // kReplaced: another file has the name, and the one that is open is whole. kOverwritten: the open
  // file itself has changed.
  enum class News { kNone, kReplaced, kOverwritten };

  explicit BakeFileWatcher(const BakeFile& playing)
      : path_(playing.path()), playing_(playing.version()), told_(playing_), seen_(playing_) {}

  // Looks at the file system, which may take its time; tells each version once.
  News look();

  // From now on this one plays, opened under the name that was given first.
  void plays(const BakeFile& file) { seen_ = told_ = playing_ = file.version(); }

 private:
  const std::string path_;
  FileVersion playing_, told_;
  std::optional<FileVersion> seen_;  // at the last look
};

}  // namespace clamor
