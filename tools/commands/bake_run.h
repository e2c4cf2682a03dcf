// bake_run.h: runs a bake from the level file to the bake file or shard, and prints its report;
// shared by clamor bake and clamor merge.
#pragma once

#include <iosfwd>
#include <string>

#include "bake/bake_request.h"
#include "bake/level_bake.h"

namespace clamor {

struct BakeRunOptions {
  std::string command;         // "bake" or "merge", for messages
  bool quiet = false;          // print only warnings and errors
  bool json_progress = false;  // print JSON lines, and otherwise only errors
  LevelBakeOptions bake;
};

// Imports the level, bakes it, writes the file and prints the report. Returns an exit code.
int run_bake_request(const BakeRequest& request, const BakeRunOptions& run, std::ostream& err);

}  // namespace clamor
