#include "tools/farm/farm_status.h"

#include <algorithm>
#include <cmath>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "tools/program/text_format.h"

namespace clamor {

FarmStatus status_of(const FarmPlan& plan) {
  FarmStatus status;
  double precision = 0;  // sum of 1 / error^2: shards are independent
  for (std::uint32_t shard = 0; shard < plan.shards; ++shard) {
    const ShardState& state = status.shards.emplace_back(state_of_shard(plan, shard, false));
    ++status.counts[static_cast<std::size_t>(state.is)];
    status.bytes += state.bytes;
    if (!state.progress) continue;
    status.photons += state.progress->photons;
    if (state.is == ShardState::Is::kRunning)
      status.photons_per_s += state.progress->photons_per_s();
    if (state.progress->error_db && *state.progress->error_db > 0)
      precision += 1 / (*state.progress->error_db * *state.progress->error_db);
  }
  if (precision > 0) status.error_db = 1 / std::sqrt(precision);
  const std::uint64_t left = plan.photons - std::min(plan.photons, status.photons);
  if (status.photons_per_s > 0)
    status.seconds_left = static_cast<double>(left) / status.photons_per_s;
  status.is_merged = is_merged(plan);
  return status;
}

void print_status(const FarmPlan& plan, const FarmStatus& status, std::ostream& out) {
  using Is = ShardState::Is;
  fmt::print(out, "{}: {}\n", printable(plan.output),
             status.is_merged ? "merged"
             : status.count(Is::kDone) == plan.shards
                 ? "all shards are done, not merged"
                 : fmt::format("{} of {} shards done", status.count(Is::kDone), plan.shards));
  if (plan.goal_db > 0)
    fmt::print(out, "  round    {}, until {:g} dB\n", plan.rounds.round, plan.goal_db);
  fmt::print(out, "  shards   {} done, {} running, {} lost, {} waiting, {} wrong\n",
             status.count(Is::kDone), status.count(Is::kRunning), status.count(Is::kLost),
             status.count(Is::kWaiting), status.count(Is::kWrong));
  fmt::print(out, "  photons  {} of {}, {:.1f} MB\n", grouped(status.photons),
             grouped(plan.photons), static_cast<double>(status.bytes) / 1e6);
  if (status.seconds_left)
    fmt::print(out, "  rate     {:.0f} photons/s, {:.0f} s left\n", status.photons_per_s,
               *status.seconds_left);
  if (status.error_db) fmt::print(out, "  known    to {:.2f} dB\n", *status.error_db);
  for (std::uint32_t shard = 0; shard < plan.shards; ++shard) {
    const ShardState& state = status.shards[shard];
    const std::string host = state.progress ? " on " + printable(state.progress->host) : "";
    if (state.is == Is::kLost) fmt::print(out, "  lost     shard {}{}\n", shard + 1, host);
    if (state.is == Is::kRunning) fmt::print(out, "  running  shard {}{}\n", shard + 1, host);
    if (!state.problem.empty()) fmt::print(out, "  wrong    {}\n", printable(state.problem));
  }
  if (!status.is_merged && status.count(Is::kRunning) < plan.shards)
    fmt::print(out, "  next     {}\n", printable(plan.resume_command()));
}

}  // namespace clamor
