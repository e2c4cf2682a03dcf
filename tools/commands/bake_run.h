// bake_run.h: runs a bake from the level file to the bake file or shard, and prints its report;
// shared by clamor bake and clamor merge.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "bake/bake_until.h"
#include "tools/commands/bake_request.h"

namespace clamor {

// Options of the run. Except for the goal, none of them changes the output.
struct BakeRunOptions {
  std::string command;  // "bake" or "merge", for messages
  std::string output;
  int threads = 0;
  std::uint64_t memory_bytes = 0;  // 0: no limit
  bool journal = true;
  bool quiet = false;               // print only warnings and errors
  bool json_progress = false;       // print JSON lines, and otherwise only errors
  bool strict = false;              // a warning is an error, and nothing is written
  std::optional<BakeGoal> goal;     // sets the number of photons and sources
  std::optional<Shard> shard;       // then `output` is that shard
  std::vector<std::string> shards;  // shards to merge
};

// Imports the level, bakes it, writes the file and prints the report. Returns an exit code.
int run_bake_request(const BakeRequest& request, const BakeRunOptions& run, std::ostream& err);

}  // namespace clamor
