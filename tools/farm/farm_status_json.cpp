// farm_status_json.cpp: the state of a farm for programs.
#include <nlohmann/json.hpp>

#include "common/printable.h"
#include "tools/farm/farm_status.h"

namespace clamor {

std::string status_json(const FarmPlan& plan, const FarmStatus& status) {
  using nlohmann::ordered_json;
  using Is = ShardState::Is;
  const auto or_null = [](const std::optional<double>& value) {
    return value ? ordered_json(*value) : ordered_json();
  };
  ordered_json shards = ordered_json::array();
  for (std::uint32_t shard = 0; shard < plan.shards; ++shard) {
    const ShardState& state = status.shards[shard];
    ordered_json one{{"shard", shard + 1}, {"state", name_of(state.is)}, {"bytes", state.bytes}};
    if (!state.problem.empty()) one["problem"] = state.problem;
    if (state.progress) {
      one["photons"] = state.progress->photons;
      one["seconds"] = state.progress->before_s + state.progress->seconds;
      one["core_seconds"] = state.progress->core_s;
      one["photons_per_s"] = state.progress->photons_per_s();
      one["host"] = state.progress->host;
      one["error_db"] = or_null(state.progress->error_db);
    }
    shards.push_back(std::move(one));
  }
  const ordered_json json{
      {"output", plan.output},
      {"merged", status.is_merged},
      {"round", plan.rounds.round},
      {"until_db", plan.goal_db > 0 ? ordered_json(plan.goal_db) : ordered_json()},
      {"counts",
       {{"total", plan.shards},
        {"done", status.count(Is::kDone)},
        {"running", status.count(Is::kRunning)},
        {"lost", status.count(Is::kLost)},
        {"waiting", status.count(Is::kWaiting)},
        {"wrong", status.count(Is::kWrong)}}},
      {"photons", status.photons},
      {"photons_total", plan.photons},
      {"photons_per_s", status.photons_per_s},
      {"seconds_left", or_null(status.seconds_left)},
      {"error_db", or_null(status.error_db)},
      {"bytes", status.bytes},
      {"preparing_s", plan.preparing_s},
      {"shards", std::move(shards)}};
  return printable_json(json.dump(2, ' ', false, ordered_json::error_handler_t::replace)) + "\n";
}

}  // namespace clamor
