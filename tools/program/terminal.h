// terminal.h: reads single keys from a terminal and restores its mode at the end.
#pragma once

#include <string>

#include "common/platform/terminal.h"

namespace clamor {

enum class Key { kNone, kForward, kBack, kLeft, kRight, kTurnLeft, kTurnRight, kUp, kDown, kQuit };

class Terminal {
 public:
  bool is_terminal() const { return input_.is_terminal(); }

  // Waits at most that long for the next key.
  Key read(int milliseconds);

 private:
  RawInput input_;
  std::string pending_;
};

}  // namespace clamor
