#include "runtime/occlusion/direct_sound.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "runtime/occlusion/edge_diffraction.h"

namespace clamor {

namespace {

constexpr std::size_t kMaxEdges = 64;  // edges beyond these take no part
constexpr double kLongestDetour_m = 40;
constexpr float kLeastOfZone = 0.03f;
// Edges beside a free line count fully where the zones of all bands together lack half of a band's
// power.
constexpr double kWholeEffect = 0.5;

}  // namespace

DirectSound direct_sound(const OcclusionGeometry& geometry, const LineOfSight& line,
                         const Bands& zone, bool line_is_free, std::uint64_t& rays) {
  DirectSound direct{.visibility = zone};
  Tones& pressure = direct.pressure;
  if (line_is_free) pressure.fill(1);
  if (line_is_free && zone == same_in_all_bands(1)) return direct;
  const Vec3 from_m(line.from_m), to_m(line.to_m);
  std::vector<EdgeBetween> found;
  geometry.find_edges(from_m, to_m, kMaxEdges, kLongestDetour_m, found);
  const DiffractionPaths paths(geometry, from_m, to_m, line.speed_of_sound_mps, std::move(found),
                               true, rays);
  for (const EdgeSound& sound : paths.sounds())
    for (std::size_t i = 0; i < kTones; ++i) pressure[i] += sound.pressure[i];
  Bands power = power_of(pressure);
  if (line_is_free) {
    // Edges take effect by degrees where they enter the zone.
    const double blocked = static_cast<double>(kBandCount) - sum_of(zone);
    const float effect = static_cast<float>(std::min(1.0, blocked / kWholeEffect));
    for (float& share : power) share = 1 + effect * (share - 1);
  }
  double clutter = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const float share = paths.clutter(b);
    const float least = line_is_free ? 0 : kLeastOfZone * zone[b];
    direct.visibility[b] = (1 - share) * std::max(power[b], least) + share * zone[b];
    clutter += static_cast<double>(share) / kBandCount;
  }
  direct.is_over_edges = !paths.sounds().empty();
  if (!line_is_free) direct.bent = mean_path(line, paths.sounds());
  if (direct.bent) direct.bent = blend(line, *direct.bent, 1 - clutter);
  return direct;
}

}  // namespace clamor
