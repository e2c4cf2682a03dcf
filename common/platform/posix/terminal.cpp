// terminal.cpp: terminals by POSIX.
#include "common/platform/terminal.h"

#include <array>

#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

namespace clamor {

namespace {

termios mode_before;  // of RawInput

}  // namespace

bool is_terminal(int descriptor) { return ::isatty(descriptor) != 0; }

std::size_t terminal_columns(int descriptor) {
  winsize size{};
  return is_terminal(descriptor) && ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

RawInput::RawInput() {
  if (!clamor::is_terminal(STDIN_FILENO) || ::tcgetattr(STDIN_FILENO, &mode_before) != 0) return;
  is_terminal_ = true;
  termios raw = mode_before;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  ::tcsetattr(STDIN_FILENO, TCSANOW, &raw);
}

RawInput::~RawInput() {
  if (is_terminal_) ::tcsetattr(STDIN_FILENO, TCSANOW, &mode_before);
}

std::optional<std::string> RawInput::read(int milliseconds) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (::poll(&input, 1, milliseconds) <= 0) return "";
  std::array<char, 64> bytes;
  const auto count = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  if (count <= 0) return std::nullopt;
  return std::string(bytes.data(), static_cast<std::size_t>(count));
}

}  // namespace clamor
