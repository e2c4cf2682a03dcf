// walk_camera.h: the listener of the window, who walks and looks round as in a game, and where to
// stand so that a place of a level is seen.
#pragma once

#include <span>
#include <vector>

#include "common/listener.h"
#include "common/vec.h"
#include "formats/level/emitter.h"
#include "formats/level/mesh.h"

namespace clamor {

// Pressed keys, from -1 to 1.
struct WalkKeys {
  double ahead = 0, right = 0, up = 0;
  double turn_left = 0;
  bool fast = false;
};

class WalkCamera {
 public:
  WalkCamera() = default;
  explicit WalkCamera(const Listener& at);

  // Turns the head: positive angles to the left and up. Up and down end at the poles.
  void look(double left_rad, double up_rad);
  // Walks on the level, whichever way the head is tilted, with a start and a stop that are smooth
  // enough not to be heard.
  void advance(const WalkKeys& keys, double seconds);
  void place(const Listener& at);

  Listener listener() const { return {position_m_, yaw_rad_, pitch_rad_}; }
  double yaw_rad() const { return yaw_rad_; }
  double pitch_rad() const { return pitch_rad_; }
  bool is_moving() const { return length(velocity_mps_) > 1e-3; }

  // The direction of the ray through a point of the picture, x to the right and y down, each from 0
  // to 1, for a vertical field of view.
  Vec3 ray(double x, double y, double aspect) const;
  // Where a point lies in the picture; false if it is behind.
  bool project(const Vec3& point_m, double aspect, double& x, double& y) const;

  static constexpr double kFieldOfView_rad = 1.15;  // vertical

 private:
  Vec3 position_m_{0, 1.7, 0}, velocity_mps_{};
  double yaw_rad_ = 0, pitch_rad_ = 0;
};

// Two metres in front of the first emitter, looking at it.
Listener in_front_of_first(const std::vector<Emitter>& emitters);

// A listener who looks at a place of `size_m` from where nothing hides it, if possible in sight of
// the first of `inside_m` (up to four), such as emitters: the place may be a hole, which has an
// outside, too. Linear in the number of triangles: a click has time.
Listener viewpoint_of(const Mesh& mesh, const Vec3& place_m, double size_m,
                      std::span<const Vec3> inside_m);

// A listener at `from_m` who looks at a place.
Listener looking_at(const Vec3& from_m, const Vec3& place_m);

}  // namespace clamor
