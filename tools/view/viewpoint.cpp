#include "tools/view/viewpoint.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/view/level_shapes.h"

namespace clamor {

namespace {

using std::numbers::pi;

constexpr int kTurns = 16;
constexpr double kPitches_rad[] = {0.2, 0.6, -0.3};  // seen from a little above is best
constexpr std::size_t kMaxInside = 4;

// How far one can go along a ray, at most `max_m`.
double free_distance_m(const Mesh& mesh, const Vec3& from_m, const Vec3& direction, double max_m) {
  const PickedTriangle hit = pick(mesh, from_m, direction);
  return hit.triangle == SIZE_MAX ? max_m : std::min(max_m, hit.distance_m);
}

bool sees(const Mesh& mesh, const Vec3& from_m, const Vec3& to_m) {
  const double distance_m = length(to_m - from_m);
  return distance_m < 1e-6 || free_distance_m(mesh, from_m, (to_m - from_m) / distance_m,
                                              distance_m) > 0.999 * distance_m;
}

}  // namespace

Listener looking_at(const Vec3& from_m, const Vec3& place_m) {
  const Vec3 to = place_m - from_m;
  return {from_m, std::atan2(-to.x, -to.z), std::atan2(to.y, std::hypot(to.x, to.z))};
}

Listener viewpoint_of(const Mesh& mesh, const Vec3& place_m, double size_m,
                      std::span<const Vec3> inside_m) {
  const double wanted_m = std::clamp(1.2 * size_m, 2.5, 15.0);
  const auto inside = inside_m.first(std::min(inside_m.size(), kMaxInside));
  Vec3 best_m = place_m + Vec3(0, 0, wanted_m);
  double best = -1;
  for (const double pitch_rad : kPitches_rad)
    for (int turn = 0; turn < kTurns; ++turn) {
      const double yaw_rad = 2 * pi * turn / kTurns;
      const Vec3 away(std::cos(pitch_rad) * std::sin(yaw_rad), std::sin(pitch_rad),
                      std::cos(pitch_rad) * std::cos(yaw_rad));
      // Places lie on surfaces, which must not hide them.
      const Vec3 start_m = place_m + 0.02 * away;
      const double free_m = free_distance_m(mesh, start_m, away, wanted_m / 0.85);
      const Vec3 eye_m = start_m + 0.85 * free_m * away;
      double score = free_m / wanted_m;
      for (std::size_t i = 0; i < inside.size(); ++i) {
        const Vec3 towards = inside[i] - place_m;
        if (const double distance_m = length(towards); distance_m > 0)
          score += 0.1 / static_cast<double>(inside.size()) * dot(away, towards) / distance_m;
        if (sees(mesh, eye_m, inside[i])) score += 1.0 / static_cast<double>(inside.size());
      }
      if (score <= best) continue;
      best = score;
      best_m = eye_m;
    }
  return looking_at(best_m, place_m);
}

}  // namespace clamor
