#include "tools/program/bake_file_watcher.h"

#include <utility>

namespace clamor {

BakeFileWatcher::Change BakeFileWatcher::check() {
  const std::optional<FileVersion> now = file_version(path_);
  const bool is_settled = now == std::exchange(seen_, now);
  if (!now || !is_settled || *now == reported_) return Change::kNone;
  reported_ = *now;
  if (*now == playing_) return Change::kNone;
  return now->is_same_file(playing_) ? Change::kOverwritten : Change::kReplaced;
}

}  // namespace clamor
