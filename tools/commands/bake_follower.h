// bake_follower.h: notices that the bake was replaced while it plays, and switches to the new one
// if wanted.
#pragma once

#include <iosfwd>
#include <memory>

#include "formats/bake_file/bake_file.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/player/player.h"
#include "tools/commands/sound_options.h"
#include "tools/program/bake_file_watcher.h"

namespace clamor {

class BakeFollower {
 public:
  // `follows`: switch to the new file; otherwise only report it. `mix` must outlive the follower.
  BakeFollower(std::shared_ptr<const BakeFile> file, bool follows, const MixArguments& mix)
      : file_(std::move(file)), watcher_(*file_), follows_(follows), mix_(mix) {}

  // Checks the file system and reports each change once. Returns true if another bake plays
  // from now on.
  bool check(Player& player, AuralizerOptions options, std::ostream& err);

 private:
  Result<void> switch_to_new(Player& player, AuralizerOptions& options);

  std::shared_ptr<const BakeFile> file_;
  BakeFileWatcher watcher_;
  const bool follows_;
  const MixArguments& mix_;
};

}  // namespace clamor
