// farm_status_json.cpp: the state of a farm for programs.
#include "tools/analysis/json_values.h"
#include "tools/farm/farm_status.h"

namespace clamor {

std::string status_json(const FarmPlan& plan, const FarmStatus& status) {
  using Is = ShardState::Is;
  OrderedJson shards = OrderedJson::array();
  for (std::uint32_t shard = 0; shard < plan.shards; ++shard) {
    const ShardState& state = status.shards[shard];
    OrderedJson one{{"shard", shard + 1}, {"state", name_of(state.is)}, {"bytes", state.bytes}};
    if (!state.problem.empty()) one["problem"] = state.problem;
    if (state.progress) {
      one["photons"] = state.progress->photons;
      one["seconds"] = state.progress->before_s + state.progress->seconds;
      one["core_seconds"] = state.progress->core_s;
      one["photons_per_s"] = state.progress->photons_per_s();
      one["host"] = state.progress->host;
      one["error_db"] = as_json(state.progress->error_db);
    }
    shards.push_back(std::move(one));
  }
  OrderedJson counts{{"total", plan.shards}};
  for (const Is is : {Is::kDone, Is::kRunning, Is::kLost, Is::kWaiting, Is::kWrong})
    counts[name_of(is)] = status.count(is);
  const OrderedJson json{
      {"output", plan.output},
      {"merged", status.is_merged},
      {"round", plan.rounds.round},
      {"until_db", plan.goal_db > 0 ? OrderedJson(plan.goal_db) : OrderedJson()},
      {"counts", std::move(counts)},
      {"photons", status.photons},
      {"photons_total", plan.photons},
      {"photons_per_s", status.photons_per_s},
      {"seconds_left", as_json(status.seconds_left)},
      {"error_db", as_json(status.error_db)},
      {"bytes", status.bytes},
      {"preparing_s", plan.preparing_s},
      {"shards", std::move(shards)}};
  return json_text(json) + "\n";
}

}  // namespace clamor
