// bake_request.h: what a bake is asked for, and carrying it out; shared by clamor bake and merge.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "bake/bake_until.h"
#include "formats/gltf/level_import.h"
#include "tools/program/arguments.h"

namespace clamor {

// The options that decide what comes out.
struct BakeRequest {
  std::string level_path;
  ImportOptions import;
  std::optional<std::string> seed, photons, sources;
  std::string copies = "on";
  double simplify_m = 0;
  double kappa = BakeSettings{}.roulette_exponent, longest_s = BakeSettings{}.longest_path_s;

  void add_options(Arguments& parser);

  // What is wrong with the values, if anything.
  std::optional<std::string> complaint() const;

  // The options again, as they would be typed; those that were left alone are left out.
  std::vector<std::string> words() const;

  // "level path, then words", and back again: what a shard keeps so that it can be merged.
  std::string note() const;
  static std::optional<BakeRequest> from_note(const std::string& note);
};

// How it is carried out. But for the goal, nothing of it changes a byte of the output.
struct BakeRunOptions {
  std::string command;  // "bake" or "merge", for messages
  std::string output;
  int threads = 0;
  std::uint64_t memory_bytes = 0;  // 0: any
  bool journal = true;
  bool quiet = false;               // nothing but warnings and errors
  bool json_progress = false;       // one JSON object a line, and nothing else but errors
  bool strict = false;              // a warning ends it with an Error, and nothing is written
  std::optional<BakeGoal> goal;     // then it decides how many photons and sources
  std::optional<Shard> shard;       // then `output` is the shard
  std::vector<std::string> shards;  // to be merged
};

// Imports, bakes, writes, prints. Returns an exit code.
int run_bake_request(const BakeRequest& request, const BakeRunOptions& manner, std::ostream& err);

}  // namespace clamor
