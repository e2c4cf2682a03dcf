// terminal.h: reads single keys from a terminal and restores its mode at the end.
#pragma once

#include <string>

#include <termios.h>

namespace clamor {

enum class Key { kNone, kForward, kBack, kLeft, kRight, kTurnLeft, kTurnRight, kUp, kDown, kQuit };

class Terminal {
 public:
  Terminal();  // unbuffered, no echo; does nothing if stdin is no terminal
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  bool is_terminal() const { return is_terminal_; }

  // Waits at most that long for the next key.
  Key read(int milliseconds);

 private:
  bool is_terminal_ = false;
  termios before_{};
  std::string pending_;
};

}  // namespace clamor
