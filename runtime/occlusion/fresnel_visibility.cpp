#include "runtime/occlusion/fresnel_visibility.h"

#include <array>
#include <cmath>
#include <iterator>

#include "runtime/occlusion/fresnel_zone.h"

namespace clamor {

namespace {

// Returns whether the path is unoccluded; nothing if it got lost between surfaces.
std::optional<bool> is_free(const OcclusionGeometry& geometry, const LineOfSight& line,
                            DetourPath path, std::uint64_t& rays) {
  for (std::size_t i = 1; i <= DetourPath::kSegments; ++i) {
    for (;;) {
      ++rays;
      const auto wall = geometry.first_surface(path.points_m[i - 1], path.points_m[i]);
      if (!wall) break;
      const PathHit hit = path.hit(*wall, i, line);
      if (hit == PathHit::kBlocked) return false;
      if (hit == PathHit::kLost) return std::nullopt;
    }
  }
  return true;
}

// Casts the ring's paths up to number `count`.
void cast(const OcclusionGeometry& geometry, const PathFrame& frame, FresnelZone& zone,
          std::size_t r, int count, std::uint64_t& rays) {
  ZoneRing& ring = zone.rings[r];
  for (; ring.cast < count; ++ring.cast) {
    const DetourPath path(frame, zone.detour_m(r, ring.cast), path_azimuth(r, ring.cast),
                          path_chance(ring.cast));
    const auto free =
        frame.length_m > 0 ? is_free(geometry, frame.line, path, rays) : std::optional<bool>(true);
    if (!free) continue;
    ++ring.counted;
    ring.free += *free;
  }
}

}  // namespace

float diffracted_amplitude(float free_fraction) {
  constexpr float kFraction[] = {0, 0.01f, 0.06f, 0.275f, 0.375f, 0.5f, 0.74f};
  constexpr float kAmplitude[] = {0, 0.15f, 0.185f, 0.295f, 0.39f, 0.59f, 1};
  for (std::size_t i = 1; i < std::size(kFraction); ++i)
    if (free_fraction < kFraction[i])
      return kAmplitude[i - 1] + (kAmplitude[i] - kAmplitude[i - 1]) *
                                     (free_fraction - kFraction[i - 1]) /
                                     (kFraction[i] - kFraction[i - 1]);
  return 1;
}

double wavelength_m(std::size_t band, double speed_of_sound_mps) {
  return speed_of_sound_mps / (1000 * std::exp2(static_cast<double>(band) - 4));
}

std::optional<bool> path_is_free(const OcclusionGeometry& geometry, const LineOfSight& line,
                                 double detour_m, double azimuth_rad, double chance,
                                 std::uint64_t& rays) {
  const PathFrame frame(line);
  if (!(frame.length_m > 0)) return true;
  return is_free(geometry, line, DetourPath(frame, detour_m, PathAzimuth(azimuth_rad), chance),
                 rays);
}

Bands fresnel_visibility(const OcclusionGeometry& geometry, const LineOfSight& line,
                         int paths_per_ring, std::uint64_t& rays, bool* line_is_free) {
  if (line_is_free != nullptr) *line_is_free = true;
  if (geometry.empty()) return same_in_all_bands(1);
  const PathFrame frame(line);
  FresnelZone zone(frame);
  const int first_paths = (paths_per_ring + 1) / 2;

  // Three rings suffice for a source whose straight line is free. Behind a wall, sound may pass
  // through any ring.
  ++rays;
  const bool line_free = geometry.is_free(line.from_m, line.to_m);
  if (line_is_free != nullptr) *line_is_free = line_free;
  bool mixed = false;
  static_assert(kBandCount == 8, "three rings: the first, the middle and the last");
  for (std::size_t r = 0; r < kZoneRings; r += line_free ? kZoneRings / 2 : 1) {
    cast(geometry, frame, zone, r, first_paths, rays);
    mixed = mixed || zone.rings[r].contradicts(line_free);
  }
  if (!mixed) return same_in_all_bands(line_free ? 1 : 0);

  for (std::size_t r = 0; r < kZoneRings; ++r) cast(geometry, frame, zone, r, first_paths, rays);
  std::array<bool, kZoneRings> settled{};
  for (std::size_t r = 0; r < kZoneRings; ++r) settled[r] = zone.is_settled(r);
  for (std::size_t r = 0; r < kZoneRings; ++r)
    if (!settled[r]) cast(geometry, frame, zone, r, paths_per_ring, rays);
  return zone.visibility();
}

}  // namespace clamor
