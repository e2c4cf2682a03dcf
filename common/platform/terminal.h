// terminal.h: the terminal of standard input and those of the outputs.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace clamor {

bool is_terminal(int descriptor);

// The width of the terminal of a standard descriptor; 0 if it is none or does not know.
std::size_t terminal_columns(int descriptor);

// Gives keys unbuffered and without echo during its lifetime, if standard input is a terminal. One
// at a time.
class RawInput {
 public:
  RawInput();
  ~RawInput();
  RawInput(const RawInput&) = delete;
  RawInput& operator=(const RawInput&) = delete;

  bool is_terminal() const { return is_terminal_; }

  // Waits at most that long for bytes; none if there are none. Nothing if the terminal was closed.
  std::optional<std::string> read(int milliseconds);

 private:
  bool is_terminal_ = false;
};

}  // namespace clamor
