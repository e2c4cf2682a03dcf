// shard_note.h: what a shard says about itself, as texts in its journal, and whether shards belong
// together.
//
// The note tells what the shard belongs to, so that a foreign, stale or unfinished one is found
// before it is merged. The progress tells how far its bake is. Neither contains a time of day, so
// that the clocks of the machines of a farm do not matter.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/result.h"

namespace clamor {

inline constexpr std::uint32_t kMaxShards = 100'000;

struct ShardNote {
  std::string program;                // shard_program() of the program that traced it
  std::uint64_t level_hash = 0;       // of everything that was read (ImportedLevel::input_hash)
  std::vector<std::uint32_t> shards;  // ascending, from 0; more than one where shards were joined
  std::uint32_t count = 1;            // of all shards of the bake
  bool is_complete = false;
  std::string request;  // path of the level and the options (tools/commands/bake_arguments.h)

  std::string text() const;
  ShardNote completed() const;  // the same of a complete shard
  static std::optional<ShardNote> from(const std::string& text);

  // The options without the level's path, which may differ between machines.
  std::string options() const;
};

// The version of this program and of its tracer's results.
std::string shard_program();

// "1-3,7" of the numbers 0, 1, 2 and 6.
std::string ranges_of(const std::vector<std::uint32_t>& ascending);

struct ShardProgress {
  std::uint64_t photons = 0;         // of the shard, traced or found in its journal
  std::uint64_t traced = 0;          // of these by the process that wrote this
  double seconds = 0;                // since that process opened the journal
  double before_s = 0;               // spent by processes before it
  double core_s = 0;                 // of processors, by all of these processes
  std::optional<double> error_db{};  // of the energy decay from the shard's photons alone
  std::string host;                  // name of the machine

  double photons_per_s() const { return seconds > 0 ? static_cast<double>(traced) / seconds : 0; }
  std::string text() const;
  static std::optional<ShardProgress> from(const std::string& text);
};

// The note of what the shards are together. Fails with the name of the first that is no shard or
// incomplete, or that another version made, or with other options than the first. Does not read
// the runs: open_journals() checks their checksums.
Result<ShardNote> note_of_shards(const std::vector<std::string>& paths);

// Fails if a shard of the bake is missing.
Result<void> check_all_there(const ShardNote& together);

// Fails with the name of the first shard that was traced from another state of the level.
Result<void> check_level_hash(const std::vector<std::string>& paths, std::uint64_t level_hash,
                              const std::string& level_path);

}  // namespace clamor
