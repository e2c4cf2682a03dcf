#include "bake/probes/probe_zones.h"

#include <algorithm>
#include <cmath>

#include "common/maths.h"

namespace clamor {

namespace {

constexpr std::uint32_t kDirections = 256;  // rays that measure how far surfaces are
constexpr double kRadiusPerFreePath = 2;    // of a zone
constexpr double kLatePerFreePath = 6;      // path length of late reflections
constexpr double kMostFreePath_m = 100;     // in the open
constexpr double kSimilarFreePaths = 2;     // within a zone, at most this ratio

constexpr std::uint32_t kNoZone = 0xffffffff;

// Mean distance to the surfaces around a place, evenly over all directions (a Fibonacci sphere).
double mean_distance_m(const Scene& scene, const Vec3& place_m) {
  std::vector<Ray> rays;
  for (std::uint32_t i = 0; i < kDirections; ++i) {
    const double y = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - y * y);
    const double turns = (3 - std::sqrt(5.0)) / 2 * i;
    const SinCos turn = sin_cos_of_turn(static_cast<float>(turns - std::floor(turns)));
    rays.push_back({Vec3f(place_m), Vec3f(Vec3(r * static_cast<double>(turn.cos), y,
                                               r * static_cast<double>(turn.sin)))});
  }
  std::vector<SurfaceHit> hits(rays.size());
  scene.first_hits(rays, hits);
  double sum = 0;
  std::uint32_t count = 0;
  for (const SurfaceHit& hit : hits) {
    if (hit.material == SurfaceHit::kNone) continue;
    sum += std::min(static_cast<double>(hit.distance_m), kMostFreePath_m);
    ++count;
  }
  return count > kDirections / 8 ? sum / count : kMostFreePath_m;
}

bool see_each_other(const Scene& scene, const Vec3& a, const Vec3& b) {
  const double apart_m = length(b - a);
  if (apart_m < 1e-6) return true;
  const auto hit = scene.intersect(a, (b - a) / apart_m);
  return !hit || hit->distance_m >= apart_m * (1 - 1e-6);
}

}  // namespace

ProbeZones group_probes(const Scene& scene, std::span<const Vec3> places_m) {
  ProbeZones zones;
  std::vector<double> free_path_m;
  for (const Vec3& place_m : places_m) free_path_m.push_back(mean_distance_m(scene, place_m));
  zones.zone_of.assign(places_m.size(), kNoZone);
  for (std::uint32_t seed = 0; seed < places_m.size(); ++seed) {
    if (zones.zone_of[seed] != kNoZone) continue;
    const auto zone = static_cast<std::uint32_t>(zones.sizes.size());
    double sum_m = 0;
    std::uint32_t size = 0;
    for (std::uint32_t p = seed; p < places_m.size(); ++p) {
      const double ratio = free_path_m[p] / std::max(free_path_m[seed], 1e-3);
      if (zones.zone_of[p] != kNoZone || ratio > kSimilarFreePaths ||
          ratio < 1 / kSimilarFreePaths ||
          length(places_m[p] - places_m[seed]) > kRadiusPerFreePath * free_path_m[seed] ||
          !see_each_other(scene, places_m[seed], places_m[p]))
        continue;
      zones.zone_of[p] = zone;
      zones.order.push_back(p);
      sum_m += free_path_m[p];
      ++size;
    }
    zones.sizes.push_back(size);
    zones.late_from_m.push_back(kLatePerFreePath * sum_m / size);
  }
  return zones;
}

}  // namespace clamor
