// keyboard_walk.h: moves a listener by keys. Each key is a step, and the listener glides to it.
#pragma once

#include "common/listener.h"
#include "tools/program/terminal.h"

namespace clamor {

class KeyboardWalk {
 public:
  explicit KeyboardWalk(const Listener& start)
      : start_(start), current_{start.position_m}, target_{start.position_m} {}

  // Moves the target by one step or turn. Other keys do nothing.
  void press(Key key);

  // Moves the listener towards the target for that long.
  void advance(double seconds);

  bool is_moving() const;
  Listener listener() const { return at(current_); }

 private:
  struct Place {
    Vec3 position_m;
    double turn_rad = 0;  // to the left, since the start
  };
  Listener at(const Place& place) const;

  const Listener start_;
  Place current_, target_;
};

}  // namespace clamor
