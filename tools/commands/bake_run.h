// bake_run.h: runs a bake from the level file to the bake file or shard, and prints its report;
// shared by clamor bake and clamor merge.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>

#include "bake/bake_request.h"
#include "bake/level_bake.h"

namespace clamor {

struct LevelReport;

struct BakeRunOptions {
  std::string command;         // "bake" or "merge", for messages
  bool quiet = false;          // print only warnings and errors
  bool json_progress = false;  // print JSON lines, and otherwise only errors
  std::string measured;        // file of measured times, to which absorptions are fitted; "": none
  LevelBakeOptions bake;
};

double share_of(std::uint64_t part, std::uint64_t whole);  // 0 of nothing

// Progress as JSON, an object a line: the level's size and how closed it is, warnings, stages after
// so many seconds, and the end.
std::string level_json(const LevelReport& report);
std::string warning_json(const std::string& text);
std::string progress_json(const BakeProgress& done, double seconds,
                          std::optional<double> seconds_left);
std::string outcome_json(const LevelBake& bake, double seconds);

// Imports the level, bakes it, writes the file and prints the report. Returns an exit code.
int run_bake_request(const BakeRequest& request, const BakeRunOptions& run, std::ostream& err);

}  // namespace clamor
