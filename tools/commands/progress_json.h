// progress_json.h: progress of a bake as JSON lines, for build systems.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "bake/bake.h"
#include "bake/report/level_report.h"

namespace clamor {

// {"stage": "level", ...}: size of the level and how closed it is.
std::string level_json(const LevelReport& report);

// {"stage": "warning", "text": "..."}
std::string warning_json(const std::string& text);

// {"stage": "tracing", ...}: progress after so many seconds.
std::string progress_json(const BakeProgress& done, double seconds,
                          std::optional<double> seconds_left);

// {"stage": "done", ...}
struct BakeOutcome {
  std::uint64_t sources = 0, photons = 0, photons_reused = 0;
  double error_db = 0, seconds = 0;
  bool goal_reached = true;
  std::size_t warnings = 0;
};
std::string outcome_json(const BakeOutcome& outcome);

}  // namespace clamor
