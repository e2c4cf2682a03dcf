// farm_schedulers.h: starts the commands of a farm here, or hands them to Slurm.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/farm/farm_plan.h"

namespace clamor {

struct FarmJob {
  std::uint32_t number = 0;  // of the shard or group, from 1
  std::string command;       // for a shell
};

// The jobs that this round still needs. Groups depend on all shards, the merge on all groups.
struct FarmWork {
  std::vector<FarmJob> shards, groups;
  bool merges = false;
  bool waits = false;                 // shards are still running
  std::vector<std::string> problems;  // of shards that are made again
  bool is_empty() const { return shards.empty() && groups.empty() && !merges; }
};

// Checks the checksums of all finished shards. Shards that run are left out.
FarmWork work_left(const FarmPlan& plan);

// Runs the jobs, `at_once` at a time, each with its output in a log in the farm's folder. Returns
// an Error that names the jobs that failed, once all others have ended.
Result<void> run_here(const FarmPlan& plan, const std::string& kind,
                      const std::vector<FarmJob>& jobs, int at_once, bool quiet, std::ostream& err);

// Submits the work that is in no queue yet to Slurm, and prints the ids of its jobs: an array of
// shards, an array of groups and the merge, each of which waits for the one before it. With a goal,
// the merge submits the next round.
Result<void> submit_to_slurm(const FarmPlan& plan, FarmWork work, std::ostream& out);

}  // namespace clamor
