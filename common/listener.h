// listener.h: a listener's head: position, orientation and velocity.
#pragma once

#include <cmath>

#include "common/vec.h"

namespace clamor {

// An orientation as people write it, in radians. Yaw 0 looks along -Z, as a glTF camera does, and
// grows to the left (counter-clockwise from above). Pitch grows upwards. Roll tilts the head about
// the direction it looks in, and grows towards the right shoulder.
struct HeadAngles {
  double yaw_rad = 0, pitch_rad = 0, roll_rad = 0;
};

// A rotation from the head's frame (+X right, +Y up, -Z ahead) to the world's, stored as a unit
// quaternion. The head's axes in the world are kept with it.
class Orientation {
 public:
  Orientation() = default;  // looks along -Z

  explicit Orientation(const HeadAngles& angles)
      : Orientation(glm::angleAxis(angles.yaw_rad, Vec3(0, 1, 0)) *
                    glm::angleAxis(angles.pitch_rad, Vec3(1, 0, 0)) *
                    glm::angleAxis(angles.roll_rad, Vec3(0, 0, -1))) {}

  // From a quaternion of any length but zero. One of length 1 is taken as it is, so that rotation()
  // of another orientation gives the same axes to the last bit.
  explicit Orientation(const Quaternion& rotation)
      : rotation_(std::abs(glm::dot(rotation, rotation) - 1) < 1e-12 ? rotation
                                                                     : glm::normalize(rotation)),
        forward_(rotation_ * Vec3(0, 0, -1)),
        right_(rotation_ * Vec3(1, 0, 0)),
        up_(cross(right_, forward_)) {}

  const Quaternion& rotation() const { return rotation_; }
  const Vec3& forward() const { return forward_; }
  const Vec3& right() const { return right_; }
  const Vec3& up() const { return up_; }

  // Returns this orientation after a turn to the left about the world's vertical axis.
  Orientation turned_left(double rad) const {
    return Orientation(glm::angleAxis(rad, Vec3(0, 1, 0)) * rotation_);
  }

 private:
  Quaternion rotation_{1, 0, 0, 0};  // w, x, y, z
  Vec3 forward_{0, 0, -1}, right_{1, 0, 0}, up_{0, 1, 0};
};

// Callers of the runtime set the position and the orientation. The auralizer sets the velocity from
// the positions of successive keyframes (ListenerMotion).
struct Listener {
  Listener() = default;
  Listener(const Vec3& at_m, const Orientation& turned = {}, const Vec3& moving_mps = Vec3(0))
      : position_m(at_m), orientation(turned), velocity_mps(moving_mps) {}
  Listener(const Vec3& at_m, double yaw_rad, double pitch_rad, double roll_rad = 0)
      : position_m(at_m), orientation(HeadAngles{yaw_rad, pitch_rad, roll_rad}) {}

  const Vec3& forward() const { return orientation.forward(); }
  const Vec3& right() const { return orientation.right(); }
  const Vec3& up() const { return orientation.up(); }

  Vec3 position_m{};
  Orientation orientation{};
  Vec3 velocity_mps{};
};

// Gives each keyframe's listener its velocity: the distance from the previous keyframe's position
// over the length of a keyframe.
class ListenerMotion {
 public:
  explicit ListenerMotion(double keyframe_s) : keyframe_s_(keyframe_s) {}

  Listener next(Listener listener) {
    listener.velocity_mps = has_last_ ? (listener.position_m - last_m_) / keyframe_s_ : Vec3(0);
    last_m_ = listener.position_m;
    has_last_ = true;
    return listener;
  }

 private:
  const double keyframe_s_;
  Vec3 last_m_{};
  bool has_last_ = false;
};

}  // namespace clamor
