#include "tools/commands/bake_file_watcher.h"

#include <utility>

namespace clamor {

BakeFileWatcher::News BakeFileWatcher::look() {
  const std::optional<FileVersion> now = file_version(path_);
  const bool is_settled = now == std::exchange(seen_, now);
  if (!now || !is_settled || *now == told_) return News::kNone;
  told_ = *now;
  if (*now == playing_) return News::kNone;
  return now->is_same_file(playing_) ? News::kOverwritten : News::kReplaced;
}

}  // namespace clamor
