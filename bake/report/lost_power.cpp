#include "bake/report/lost_power.h"

#include <algorithm>

#include <fmt/format.h>

#include "formats/bake_file/enclosure.h"

namespace clamor {

namespace {

constexpr double kShown = 0.0005;  // smaller shares are 0.0 %

bool transmits(const Material& material) {
  return std::ranges::any_of(material.transmission, [](float share) { return share > 0; });
}

bool knows_openings(const LevelFindings& findings) {
  const Enclosure enclosure = enclosure_of(findings);
  return enclosure == Enclosure::kClosed ||
         (enclosure != Enclosure::kUnknown && findings.escaped_share > 0);
}

}  // namespace

LostPower lost_power(const BakeStatistics& statistics, std::span<const Material> materials) {
  const double emitted = sum_of(statistics.power_emitted);
  const double lost = emitted > 0 ? sum_of(statistics.power_escaped) / emitted : 0;
  if (!knows_openings(statistics.findings) || std::ranges::none_of(materials, transmits))
    return {lost, 0};
  const double through_openings = std::min(lost, statistics.findings.escaped_share);
  return {through_openings, lost - through_openings};
}

std::string ways_of(const LostPower& lost) {
  const bool has_openings = lost.through_openings >= kShown,
             has_walls = lost.through_walls >= kShown;
  if (has_openings && has_walls)
    return fmt::format("{:.1f} % through openings and {:.1f} % through walls",
                       100 * lost.through_openings, 100 * lost.through_walls);
  return has_walls ? "through walls" : has_openings ? "through openings" : "";
}

std::string in_words(const LostPower& lost) {
  const std::string ways = ways_of(lost);
  return fmt::format("{:.1f} % of the power{}", 100 * lost.all(), ways.empty() ? "" : ", " + ways);
}

}  // namespace clamor
