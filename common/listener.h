// listener.h: where a listener is and which way they look.
#pragma once

#include <cmath>

#include "common/vec.h"

namespace clamor {

// Yaw 0 looks along -Z, as a glTF camera does, and grows to the left (counter-clockwise from
// above); pitch grows upwards. Radians.
struct Listener {
  Vec3 position_m{};
  double yaw_rad = 0;
  double pitch_rad = 0;

  Vec3 forward() const {
    return {-std::sin(yaw_rad) * std::cos(pitch_rad), std::sin(pitch_rad),
            -std::cos(yaw_rad) * std::cos(pitch_rad)};
  }
  Vec3 right() const { return {std::cos(yaw_rad), 0, -std::sin(yaw_rad)}; }
  Vec3 up() const { return cross(right(), forward()); }
};

}  // namespace clamor
