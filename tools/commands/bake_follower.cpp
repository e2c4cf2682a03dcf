#include "tools/commands/bake_follower.h"

#include <ostream>
#include <string>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "runtime/engine/auralizer_options.h"
#include "runtime/player/player.h"

namespace clamor {

bool BakeFollower::check(Player& player, AuralizerOptions options, std::ostream& err) {
  const BakeFileWatcher::Change change = watcher_.check();
  if (change == BakeFileWatcher::Change::kNone) return false;
  const bool is_replaced = change == BakeFileWatcher::Change::kReplaced;
  const std::string what =
      fmt::format("{} was {}", file_->path(), is_replaced ? "replaced" : "overwritten");
  if (!follows_) {
    fmt::print(err, "{} on disk; {}. 'clamor play --follow' switches to the new one\n", what,
               is_replaced ? "the old one keeps playing"
                           : "the parts of the old one in memory keep playing");
    return false;
  }
  const Result<void> switched = switch_to_new(player, options);
  if (switched.ok())
    fmt::print(err, "{} on disk; the new one plays\n", what);
  else
    fmt::print(err, "{} on disk, but the old one keeps playing: {}\n", what,
               switched.error().message);
  return switched.ok();
}

Result<void> BakeFollower::switch_to_new(Player& player, AuralizerOptions& options) {
  auto opened = BakeFile::open(file_->path(), mix_.access());
  if (!opened.ok()) return opened.error();
  InputFiles inputs;  // compared with the outputs when the program started
  if (const auto read = mix_.read_script(options, opened->signal_count(), inputs); !read.ok())
    return read;
  auto file = std::make_shared<const BakeFile>(std::move(*opened));
  if (const auto replaced = player.replace(file, options); !replaced.ok()) return replaced;
  file_ = std::move(file);
  watcher_.plays(*file_);
  return {};
}

}  // namespace clamor
