#include "runtime/occlusion/fresnel_visibility.h"

#include <array>
#include <cmath>
#include <iterator>

#include "runtime/occlusion/fresnel_zone.h"

namespace clamor {

namespace {

// True if free, false if not; nothing if it got lost.
std::optional<bool> is_free(const OcclusionGeometry& geometry, const LineOfSight& line, Way way,
                            std::uint64_t& rays) {
  for (std::size_t i = 1; i <= Way::kPieces; ++i) {
    for (;;) {
      ++rays;
      const OccluderPlane* const wall = geometry.first_surface(way.at[i - 1], way.at[i]);
      if (wall == nullptr) break;
      const Way::Met met = way.meet(*wall, i, line);
      if (met == Way::Met::kBlocked) return false;
      if (met == Way::Met::kLost) return std::nullopt;
    }
  }
  return true;
}

// The ring's ways up to the `count`-th.
void cast(const OcclusionGeometry& geometry, const PathFrame& frame, FresnelZone& zone,
          std::size_t r, int count, std::uint64_t& rays) {
  ZoneRing& ring = zone.rings[r];
  for (; ring.cast < count; ++ring.cast) {
    const Way way(frame, zone.detour_m(r, ring.cast), path_azimuth(r, ring.cast));
    const auto free =
        frame.way_m > 0 ? is_free(geometry, frame.line, way, rays) : std::optional<bool>(true);
    if (!free) continue;
    ++ring.counted;
    ring.free += *free;
  }
}

}  // namespace

float diffracted_amplitude(float free_share) {
  constexpr float kShare[] = {0, 0.01f, 0.06f, 0.275f, 0.375f, 0.5f, 0.74f};
  constexpr float kAmplitude[] = {0, 0.15f, 0.185f, 0.295f, 0.39f, 0.59f, 1};
  for (std::size_t i = 1; i < std::size(kShare); ++i)
    if (free_share < kShare[i])
      return kAmplitude[i - 1] + (kAmplitude[i] - kAmplitude[i - 1]) *
                                     (free_share - kShare[i - 1]) / (kShare[i] - kShare[i - 1]);
  return 1;
}

double wavelength_m(std::size_t band, double speed_of_sound_mps) {
  return speed_of_sound_mps / (1000 * std::exp2(static_cast<double>(band) - 4));
}

std::optional<bool> path_is_free(const OcclusionGeometry& geometry, const LineOfSight& line,
                                 double detour_m, double turn_rad, std::uint64_t& rays) {
  const PathFrame frame(line);
  if (!(frame.way_m > 0)) return true;
  return is_free(geometry, line, Way(frame, detour_m, PathAzimuth(turn_rad)), rays);
}

Bands fresnel_visibility(const OcclusionGeometry& geometry, const LineOfSight& line,
                         int paths_per_ring, std::uint64_t& rays, bool* straight_is_free) {
  if (straight_is_free != nullptr) *straight_is_free = true;
  if (geometry.empty()) return same_in_all_bands(1);
  const PathFrame frame(line);
  FresnelZone zone(frame);
  const int first_ways = (paths_per_ring + 1) / 2;

  // Most sources are in plain sight, where three rings tell enough, or behind a wall, where sound
  // may come through any.
  ++rays;
  const bool straight = geometry.is_free(line.from_m, line.to_m);
  if (straight_is_free != nullptr) *straight_is_free = straight;
  bool mixed = false;
  for (std::size_t r = 0; r < kZoneRings; r += straight ? kZoneRings / 2 : 1) {
    cast(geometry, frame, zone, r, first_ways, rays);
    mixed = mixed || zone.rings[r].contradicts(straight);
  }
  if (!mixed) return same_in_all_bands(straight ? 1 : 0);

  for (std::size_t r = 0; r < kZoneRings; ++r) cast(geometry, frame, zone, r, first_ways, rays);
  std::array<bool, kZoneRings> settled{};
  for (std::size_t r = 0; r < kZoneRings; ++r) settled[r] = zone.is_settled(r);
  for (std::size_t r = 0; r < kZoneRings; ++r)
    if (!settled[r]) cast(geometry, frame, zone, r, paths_per_ring, rays);
  return zone.visibility();
}

}  // namespace clamor
