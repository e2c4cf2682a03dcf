// keyboard_walk.h: moves a listener by keys. Each key is a step, and the listener glides to it.
#pragma once

#include "common/listener.h"
#include "tools/program/terminal.h"

namespace clamor {

class KeyboardWalk {
 public:
  explicit KeyboardWalk(const Listener& start) : listener_(start), target_(start) {}

  // Moves the target by one step or turn. Other keys do nothing.
  void press(Key key);

  // Moves the listener towards the target for that long.
  void advance(double seconds);

  bool is_moving() const;
  const Listener& listener() const { return listener_; }

 private:
  Listener listener_, target_;
};

}  // namespace clamor
