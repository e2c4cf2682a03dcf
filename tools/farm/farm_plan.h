// farm_plan.h: a bake that is shared out among machines: its shards, their commands and their
// state.
//
// A farm is a folder beside the output, OUTPUT.farm, that all machines share: the plan (farm.json)
// and one file per shard. Nothing runs in it: commands are lines for a shell, which any scheduler
// starts, and what is done is read from the shards, which are journals. There is no server, and no
// time of day is written or compared.
//
// More than `merged_at_once` shards are merged in two steps, through groups of shards.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bake/bake_until.h"
#include "bake/journal/trace_journal.h"
#include "common/result.h"

namespace clamor {

struct FarmPlan {
  std::string made_by;               // shard_program()
  std::string program;               // path of clamor on the machines
  std::string folder;                // that relative paths in the options start from
  std::string level, output;         // absolute paths
  std::uint64_t level_hash = 0;      // content hash of the level and its files
  std::vector<std::string> options;  // of the bake, without --photons and --sources of rounds
  std::uint32_t shards = 1, merged_at_once = 256;
  int threads = 1;                 // of each shard
  std::uint64_t memory_bytes = 0;  // limit of the merge; 0: none
  double goal_db = 0;              // of --until; 0: none
  BakeRounds rounds;               // where there is a goal

  // Estimates, from a pilot.
  std::uint64_t photons = 0;  // of all shards
  double shard_s = 0;         // of the largest shard
  double preparing_s = 0;     // its part before the first photon
  std::uint64_t shard_memory_bytes = 0, merge_memory_bytes = 0;

  static std::string folder_of(const std::string& output);
  static Result<FarmPlan> load(const std::string& output);
  Result<void> save() const;

  // Goes on to a later round, and enlarges the estimates as it is larger.
  void go_to(const BakeRounds& later);

  // Whether the other plans the same bake in the same shards, in whatever round it is.
  bool is_same_bake(const FarmPlan& other) const;

  std::string file_of_shard(std::uint32_t shard) const;  // from 0
  std::uint32_t groups() const;                          // 0: merged in one step
  std::vector<std::uint32_t> shards_of_group(std::uint32_t group) const;
  std::string file_of_group(std::uint32_t group) const;

  // Whether the options may name files relative to the folder.
  bool names_files() const;

  // The words that the bake is asked for in this round, and that its file will name.
  std::vector<std::string> words() const;

  // The words of `clamor merge` that join a group.
  std::vector<std::string> words_of_group(std::uint32_t group) const;

  // Lines for a shell.
  std::string shard_command(std::uint32_t shard) const;
  std::string group_command(std::uint32_t group) const;
  std::string merge_command() const;

  std::string resume_command() const;  // as a person types it

  // A short name of the farm, for jobs.
  std::string short_hash() const;
};

struct ShardState {
  enum class Is : std::uint8_t { kWaiting, kRunning, kLost, kDone, kWrong };
  Is is = Is::kWaiting;
  std::string problem;  // why it is wrong
  std::optional<ShardProgress> progress;
  std::uint64_t bytes = 0;
};
const char* name_of(ShardState::Is is);

// The state of a shard from what its journal says; `checks_all` also checks the checksums of a
// finished one.
ShardState state_of_shard(const FarmPlan& plan, std::uint32_t shard, bool checks_all);

// Whether the groups and the output are made of the shards of this round. Checks the checksums of a
// group.
bool is_group_done(const FarmPlan& plan, std::uint32_t group);
bool is_merged(const FarmPlan& plan);

}  // namespace clamor
