// terminal.h: single keys from a terminal, which is as it was when this is gone.
#pragma once

#include <string>

#include <termios.h>

namespace clamor {

enum class Key { kNone, kForward, kBack, kLeft, kRight, kTurnLeft, kTurnRight, kUp, kDown, kQuit };

class Terminal {
 public:
  Terminal();  // keys are read at once and not shown; does nothing where stdin is no terminal
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  bool is_terminal() const { return is_terminal_; }

  // The next key, waiting for it at most so long.
  Key read(int milliseconds);

 private:
  bool is_terminal_ = false;
  termios before_{};
  std::string pending_;
};

}  // namespace clamor
