#include "tools/commands/keyboard_walk.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace clamor {

namespace {

constexpr double kStep_m = 0.4;  // per key
constexpr double kTurn_rad = 10 * std::numbers::pi / 180;
struct Step {
  Key key;
  double ahead = 0, right = 0, up = 0, turn_left = 0;
};
constexpr Step kSteps[] = {{Key::kForward, 1},           {Key::kBack, -1},
                           {Key::kRight, 0, 1},          {Key::kLeft, 0, -1},
                           {Key::kUp, 0, 0, 1},          {Key::kDown, 0, 0, -1},
                           {Key::kTurnLeft, 0, 0, 0, 1}, {Key::kTurnRight, 0, 0, 0, -1}};
constexpr double kGlide_s = 0.15, kTurnGlide_s = 0.05;  // time constants
constexpr double kMaxAdvance_s = 0.02;                  // so that a first step is not a jump

}  // namespace

Listener KeyboardWalk::at(const Place& place) const {
  return {place.position_m, place.turn_rad == 0 ? start_.orientation
                                                : start_.orientation.turned_left(place.turn_rad)};
}

void KeyboardWalk::press(Key key) {
  const Vec3 up(0, 1, 0), forward = normalize(cross(up, at(target_).right()));
  const Vec3 right = cross(forward, up);
  for (const Step& step : kSteps) {
    if (step.key != key) continue;
    target_.position_m += kStep_m * (step.ahead * forward + step.right * right + step.up * up);
    target_.turn_rad += kTurn_rad * step.turn_left;
  }
}

void KeyboardWalk::advance(double seconds) {
  const double step_s = std::min(seconds, kMaxAdvance_s);
  const auto share = [step_s](double glide_s) { return 1 - std::exp(-step_s / glide_s); };
  current_.position_m += share(kGlide_s) * (target_.position_m - current_.position_m);
  current_.turn_rad += share(kTurnGlide_s) * (target_.turn_rad - current_.turn_rad);
}

bool KeyboardWalk::is_moving() const {
  constexpr double kNear = 1e-4;
  return length(target_.position_m - current_.position_m) >= kNear ||
         std::abs(target_.turn_rad - current_.turn_rad) >= kNear;
}

}  // namespace clamor
