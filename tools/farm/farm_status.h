// farm_status.h: the progress of a farm, from the notes of its shards.
#pragma once

#include <array>
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "tools/farm/farm_plan.h"

namespace clamor {

struct FarmStatus {
  std::vector<ShardState> shards;
  std::array<std::size_t, 5> counts{};  // by ShardState::Is
  std::uint64_t photons = 0, bytes = 0;
  double photons_per_s = 0;  // of the running shards
  std::optional<double> seconds_left, error_db;
  bool is_merged = false;

  std::size_t count(ShardState::Is is) const { return counts[static_cast<std::size_t>(is)]; }
};

FarmStatus status_of(const FarmPlan& plan);
void print_status(const FarmPlan& plan, const FarmStatus& status, std::ostream& out);
std::string status_json(const FarmPlan& plan, const FarmStatus& status);

}  // namespace clamor
