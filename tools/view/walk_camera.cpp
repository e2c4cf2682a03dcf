#include "tools/view/walk_camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/view/level_shapes.h"

namespace clamor {

namespace {

constexpr double kWalk_mps = 2.0, kRun_mps = 6.0, kTurn_rad_s = 1.6;
constexpr double kSpeedUp_s = 0.12;  // time constant
constexpr double kMaxStep_s = 0.1;   // so that a window that was busy is no jump

}  // namespace

Listener in_front_of_first(const std::vector<Emitter>& emitters) {
  if (emitters.empty()) return {};
  const Emitter& emitter = emitters.front();
  Vec3 ahead(emitter.axis.x, 0, emitter.axis.z);
  ahead = length(ahead) > 1e-6 ? normalize(ahead) : Vec3(0, 0, 1);
  return {emitter.position_m + 2.0 * ahead, std::atan2(ahead.x, ahead.z), 0};
}

WalkCamera::WalkCamera(const Listener& at) { place(at); }

void WalkCamera::place(const Listener& at) {
  position_m_ = at.position_m;
  velocity_mps_ = Vec3(0);
  const Vec3& forward = at.forward();
  pitch_rad_ = std::asin(std::clamp(forward.y, -1.0, 1.0));
  if (std::hypot(forward.x, forward.z) > 1e-9) yaw_rad_ = std::atan2(-forward.x, -forward.z);
}

void WalkCamera::look(double left_rad, double up_rad) {
  constexpr double kMostPitch_rad = std::numbers::pi / 2 - 0.01;
  yaw_rad_ = std::remainder(yaw_rad_ + left_rad, 2 * std::numbers::pi);
  pitch_rad_ = std::clamp(pitch_rad_ + up_rad, -kMostPitch_rad, kMostPitch_rad);
}

void WalkCamera::advance(const WalkKeys& keys, double seconds) {
  const double step_s = std::min(seconds, kMaxStep_s);
  yaw_rad_ += keys.turn_left * kTurn_rad_s * step_s;
  const Vec3 ahead(-std::sin(yaw_rad_), 0, -std::cos(yaw_rad_));
  const Vec3 right(std::cos(yaw_rad_), 0, -std::sin(yaw_rad_));
  Vec3 wanted = ahead * keys.ahead + right * keys.right + Vec3(0, keys.up, 0);
  if (const double size = length(wanted); size > 1) wanted /= size;
  wanted *= keys.fast ? kRun_mps : kWalk_mps;
  velocity_mps_ += (1 - std::exp(-step_s / kSpeedUp_s)) * (wanted - velocity_mps_);
  position_m_ += velocity_mps_ * step_s;
}

Vec3 WalkCamera::ray(double x, double y, double aspect) const {
  const Listener at = listener();
  const double tangent = std::tan(kFieldOfView_rad / 2);
  return normalize(at.forward() + at.right() * ((2 * x - 1) * tangent * aspect) +
                   at.up() * ((1 - 2 * y) * tangent));
}

bool WalkCamera::project(const Vec3& point_m, double aspect, double& x, double& y) const {
  const Listener at = listener();
  const Vec3 to = point_m - at.position_m;
  const double depth = dot(to, at.forward());
  if (depth < 0.02) return false;
  const double tangent = std::tan(kFieldOfView_rad / 2);
  x = (1 + dot(to, at.right()) / (depth * tangent * aspect)) / 2;
  y = (1 - dot(to, at.up()) / (depth * tangent)) / 2;
  return true;
}

namespace {

using std::numbers::pi;

constexpr int kTurns = 16;
constexpr double kPitches_rad[] = {0.2, 0.6, -0.3};  // seen from a little above is best
constexpr std::size_t kMaxInside = 4;

bool sees(const Mesh& mesh, const Vec3& from_m, const Vec3& to_m) {
  const double distance_m = length(to_m - from_m);
  return distance_m < 1e-6 ||
         free_m(mesh, from_m, (to_m - from_m) / distance_m, distance_m) > 0.999 * distance_m;
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
      const double clear_m = free_m(mesh, start_m, away, wanted_m / 0.85);
      const Vec3 eye_m = start_m + 0.85 * clear_m * away;
      double score = clear_m / wanted_m;
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
