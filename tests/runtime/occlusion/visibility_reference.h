// visibility_reference.h: visibility per band by many paths all over the Fresnel zone. The model is
// that of fresnel_visibility.h, without sharing between bands, interpolation or optimization.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/fresnel_zone.h"

namespace clamor::testing {

inline double halton(std::uint32_t base, std::uint32_t i) {
  double value = 0, digit = 1;
  for (; i > 0; i /= base) {
    digit /= base;
    value += digit * (i % base);
  }
  return value;
}

// Returns whether the path that is `detour_m` longer than the straight line, on the side given by
// `azimuth_rad`, is unoccluded. `chance` in [0, 1) decides where the listener is close behind the
// plane of a wall. Nothing if the path gets lost between surfaces.
inline std::optional<bool> path_is_free(const OcclusionGeometry& geometry, const LineOfSight& line,
                                        double detour_m, double azimuth_rad, double chance,
                                        std::uint64_t& rays) {
  const PathFrame frame(line);
  if (!(frame.length_m > 0)) return true;
  DetourPath path(frame, detour_m, PathAzimuth(azimuth_rad), chance);
  for (std::size_t i = 1; i <= DetourPath::kSegments; ++i)
    for (;;) {
      ++rays;
      const auto wall = geometry.first_surface(path.points_m[i - 1], path.points_m[i]);
      if (!wall) break;
      const PathHit hit = path.hit(*wall, i, line);
      if (hit == PathHit::kBlocked) return false;
      if (hit == PathHit::kLost) return std::nullopt;
    }
  return true;
}

// Share of the power that passes. Adds the number of rays to `rays`.
inline double slow_visibility(const OcclusionGeometry& geometry, const LineOfSight& line,
                              std::size_t band, std::uint32_t paths, std::uint64_t& rays) {
  const double distance_m = length(Vec3(line.to_m) - Vec3(line.from_m));
  const double wave_m = line.speed_of_sound_mps / (62.5 * std::exp2(static_cast<double>(band)));
  const auto share_of = [&](double inner_m2, double outer_m2, std::uint32_t count) {
    int counted = 0, passed = 0;
    for (std::uint32_t i = 1; i <= count; ++i) {
      const double area_m2 = inner_m2 + (outer_m2 - inner_m2) * halton(2, i);
      const double detour_m = std::sqrt(distance_m * distance_m + area_m2) - distance_m;
      const auto free = path_is_free(geometry, line, detour_m, 2 * std::numbers::pi * halton(3, i),
                                     halton(5, i), rays);
      counted += free.has_value();
      passed += free.value_or(false);
    }
    return static_cast<double>(passed) / std::max(counted, 1);
  };
  const auto area_m2_of = [&](double detour_m) { return detour_m * (2 * distance_m + detour_m); };
  int wide = 0, wide_free = 0, narrow = 0, narrow_free = 0;
  for (std::uint32_t i = 1; i <= paths; ++i) {
    const double area_m2 = 2 * wave_m * (2 * distance_m + 2 * wave_m) * halton(2, i);
    const double detour_m = std::sqrt(distance_m * distance_m + area_m2) - distance_m;
    const auto free = path_is_free(geometry, line, detour_m, 2 * std::numbers::pi * halton(3, i),
                                   halton(5, i), rays);
    if (!free) continue;
    ++wide;
    wide_free += *free;
    if (detour_m > wave_m) continue;
    ++narrow;
    narrow_free += *free;
  }
  double longer = 0;  // power by the paths of long detours
  for (std::size_t k = 0; k <= band; ++k) {
    const double min_m = wave_m * std::exp2(static_cast<double>(k));
    const double amplitude = 0.36 * share_of(area_m2_of(min_m), area_m2_of(2 * min_m), paths / 4);
    longer += amplitude * amplitude * std::exp2(-static_cast<double>(k));
  }
  const double share =
      0.7 * narrow_free / std::max(narrow, 1) + 0.3 * wide_free / std::max(wide, 1);
  const auto curve = [](double fraction) {
    return std::pow(static_cast<double>(diffracted_amplitude(static_cast<float>(fraction))), 2);
  };
  const double by_edge = std::max(curve(share), longer);
  if (share >= 0.5) return by_edge;
  const double line_m = std::exp2(-7) * line.speed_of_sound_mps / 62.5;
  const double is_apart = std::max(2 * share_of(0, area_m2_of(line_m), paths / 4) - 1, 0.0);
  return by_edge + is_apart * (curve(1 - share) - by_edge);
}

}  // namespace clamor::testing
