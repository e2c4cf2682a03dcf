#include "bake/probes/reachable_air.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>

#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr std::size_t kMaxSeeds = 4096, kMaxJudged = 128;
constexpr double kLeastSky_m = 3, kGreatestSky_m = 10, kSkyOfWidth = 0.15;

Bounds bounds_in_double(const Mesh& mesh) {
  const Boundsf bounds = bounds_of(mesh);
  return {Vec3(bounds.low_m), Vec3(bounds.high_m)};
}

Bounds with_sky(Bounds bounds, bool is_closed, double sky_m) {
  if (is_closed) return bounds;
  const Vec3 size_m = bounds.high_m - bounds.low_m;
  const double wide_m = kSkyOfWidth * std::max(size_m.x, size_m.z);
  bounds.high_m.y += std::min(sky_m, std::clamp(wide_m, kLeastSky_m, kGreatestSky_m));
  return bounds;
}

}  // namespace

Emitter emitter_at(const Vec3& place_m) {
  Emitter emitter;
  emitter.position_m = place_m;
  return emitter;
}

ReachableAir::ReachableAir(const Scene& scene, const Level& level, double sky_m)
    : scene_(scene),
      level_(level),
      space_(scene, level.mesh, level.materials),
      bounds_(bounds_in_double(level.mesh)),
      lattice_(scene, with_sky(bounds_, space_.is_closed(), sky_m)) {
  std::vector<Vec3> seeds_m = level.probes_m;
  for (const Emitter& emitter : level.emitters) seeds_m.push_back(emitter.position_m);
  if (!seeds_m.empty()) {
    flood_from(seeds_m);
    return;
  }
  const auto enclosed_m = space_.enclosed_points_m();
  flood_from({enclosed_m.begin(), enclosed_m.end()});
  if (!is_closed()) flood_from_sky();
}

// A seed whose cell is reached already is not judged, so that further emitters in a room cost
// little and change nothing.
void ReachableAir::flood_from(const std::vector<Vec3>& seeds_m) {
  std::optional<Audibility> audibility;
  std::size_t judged = 0;
  for (Vec3 seed_m : thinned<Vec3>(seeds_m, kMaxSeeds)) {
    auto cell = lattice_.visible_cell(seed_m, !is_closed());
    if (cell && lattice_.is_reached(*cell)) continue;
    if (++judged > kMaxJudged) return;
    if (!audibility) audibility.emplace(scene_, level_.mesh, level_.materials);
    const Emitter emitter = emitter_at(seed_m);
    const auto bad = audibility->inaudible(std::span(&emitter, 1));
    if (!bad.empty()) {
      const InaudiblePlace& place = bad.front().place;
      if (place.why != InaudibleCause::kOnSurface || !place.alternative_m) continue;
      cell = lattice_.visible_cell(*place.alternative_m, !is_closed());
    }
    if (cell) lattice_.flood(*cell);
  }
}

void ReachableAir::flood_from_sky() {
  const int top = lattice_.count(1) - 1;
  for (int x = 0; x < lattice_.count(0); ++x)
    for (int z = 0; z < lattice_.count(2); ++z)
      if (!scene_.intersect(lattice_.centre_m({x, top, z}), Vec3(0, 1, 0)))
        lattice_.flood({x, top, z});
}

}  // namespace clamor
