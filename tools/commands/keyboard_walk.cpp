#include "tools/commands/keyboard_walk.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace clamor {

namespace {

constexpr double kStep_m = 0.4;  // per key
constexpr double kTurn_rad = 10 * std::numbers::pi / 180;
constexpr double kGlide_s = 0.15, kTurnGlide_s = 0.05;  // time constants
constexpr double kMaxAdvance_s = 0.02;                  // so that a first step is not a jump

}  // namespace

void KeyboardWalk::press(Key key) {
  const Vec3 forward(-std::sin(target_.yaw_rad), 0, -std::cos(target_.yaw_rad));
  switch (key) {
    case Key::kForward:
      target_.position_m += kStep_m * forward;
      break;
    case Key::kBack:
      target_.position_m -= kStep_m * forward;
      break;
    case Key::kLeft:
      target_.position_m -= kStep_m * target_.right();
      break;
    case Key::kRight:
      target_.position_m += kStep_m * target_.right();
      break;
    case Key::kTurnLeft:
      target_.yaw_rad += kTurn_rad;
      break;
    case Key::kTurnRight:
      target_.yaw_rad -= kTurn_rad;
      break;
    case Key::kUp:
      target_.position_m.y += kStep_m;
      break;
    case Key::kDown:
      target_.position_m.y -= kStep_m;
      break;
    case Key::kNone:
    case Key::kQuit:
      break;
  }
}

void KeyboardWalk::advance(double seconds) {
  const double step_s = std::min(seconds, kMaxAdvance_s);
  const auto share = [step_s](double glide_s) { return 1 - std::exp(-step_s / glide_s); };
  listener_.position_m += share(kGlide_s) * (target_.position_m - listener_.position_m);
  listener_.yaw_rad += share(kTurnGlide_s) * (target_.yaw_rad - listener_.yaw_rad);
}

bool KeyboardWalk::is_moving() const {
  constexpr double kNear = 1e-4;
  return length(target_.position_m - listener_.position_m) >= kNear ||
         std::abs(target_.yaw_rad - listener_.yaw_rad) >= kNear;
}

}  // namespace clamor
