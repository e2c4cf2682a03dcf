// progress_json.cpp: progress of a bake as JSON lines, for build systems.
#include <algorithm>

#include <fmt/format.h>

#include "bake/report/level_report.h"
#include "formats/bake_file/bake_contents.h"
#include "tools/analysis/json_values.h"
#include "tools/commands/bake_run.h"

namespace clamor {

double share_of(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

std::string level_json(const LevelReport& report) {
  const LevelOpenings& openings = report.openings;
  return fmt::format(
      "{{\"stage\": \"level\", \"triangles\": {}, \"area_m2\": {:.2f}, "
      "\"welded_corners\": {}, \"without_area\": {}, \"duplicated\": {}, "
      "\"boundary_edges_m\": {:.2f}, \"thin_gaps\": {}, \"escaped_power_share\": {:.4f}, "
      "\"mean_free_path_m\": {:.2f}}}",
      report.triangles, report.area_m2, report.welded_vertices, report.degenerate,
      report.duplicated, report.free_edges_m, report.gaps.size(), openings.escaped_share,
      openings.mean_free_path_m);
}

std::string warning_json(const std::string& text) {
  // Names may be invalid UTF-8, but JSON may not.
  return "{\"stage\": \"warning\", \"text\": " + json_text(OrderedJson(text), -1) + "}";
}

std::string progress_json(const BakeProgress& done, double seconds,
                          std::optional<double> seconds_left) {
  return fmt::format(
      "{{\"stage\": \"{}\", \"photons\": {}, \"photons_total\": {}, \"photons_reused\": {}, "
      "\"bounces\": {}, \"bounces_per_s\": {:.0f}, \"escaped_share\": {:.4f}, \"error_db\": {}, "
      "\"seconds\": {:.3f}, "
      "\"seconds_left\": {}}}",
      done.stage, done.photons_done, done.photons_total, done.photons_reused, done.bounces,
      static_cast<double>(done.bounces) / std::max(seconds, 1e-3),
      share_of(done.escaped, done.photons_done),
      done.error_db > 0 ? fmt::format("{:.3f}", done.error_db) : "null", seconds,
      seconds_left ? fmt::format("{:.3f}", *seconds_left) : "null");
}

std::string outcome_json(const LevelBake& bake, double seconds) {
  const BakeReport& report = bake.report();
  return fmt::format(
      "{{\"stage\": \"done\", \"sources\": {}, \"photons\": {}, \"photons_reused\": {}, "
      "\"error_db\": {:.3f}, \"goal_reached\": {}, \"warnings\": {}, \"seconds\": {:.3f}}}",
      bake.contents().source_count() + report.instanced_sources, report.photons,
      report.photons_reused, static_cast<double>(bake.contents().statistics.decay.error_db),
      bake.missed_goal().empty(), bake.warnings(), seconds);
}

}  // namespace clamor
