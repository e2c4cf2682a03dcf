// terminal.cpp: the console.
#include "common/platform/terminal.h"

#include <io.h>

#include "common/platform/windows/win32.h"

namespace clamor {

namespace {

DWORD mode_before = 0;  // of RawInput

HANDLE console_of(int descriptor) { return reinterpret_cast<HANDLE>(::_get_osfhandle(descriptor)); }

}  // namespace

bool is_terminal(int descriptor) {
  DWORD mode = 0;
  return ::GetConsoleMode(console_of(descriptor), &mode) != 0;
}

std::size_t terminal_columns(int descriptor) {
  CONSOLE_SCREEN_BUFFER_INFO console{};
  if (::GetConsoleScreenBufferInfo(console_of(descriptor), &console) == 0) return 0;
  return static_cast<std::size_t>(console.srWindow.Right - console.srWindow.Left + 1);
}

RawInput::RawInput() {
  const HANDLE input = ::GetStdHandle(STD_INPUT_HANDLE);
  if (::GetConsoleMode(input, &mode_before) == 0) return;
  is_terminal_ = true;
  ::SetConsoleMode(input, (mode_before & ~DWORD{ENABLE_LINE_INPUT | ENABLE_ECHO_INPUT}) |
                              ENABLE_VIRTUAL_TERMINAL_INPUT);
}

RawInput::~RawInput() {
  if (is_terminal_) ::SetConsoleMode(::GetStdHandle(STD_INPUT_HANDLE), mode_before);
}

// Reads events rather than bytes, which would wait for a key after the mouse moved.
std::optional<std::string> RawInput::read(int milliseconds) {
  const HANDLE input = ::GetStdHandle(STD_INPUT_HANDLE);
  if (::WaitForSingleObject(input, static_cast<DWORD>(milliseconds)) != WAIT_OBJECT_0) return "";
  std::wstring text;
  DWORD waiting = 0, read = 0;
  INPUT_RECORD event{};
  if (::GetNumberOfConsoleInputEvents(input, &waiting) == 0) return std::nullopt;
  for (; waiting > 0 && ::ReadConsoleInputW(input, &event, 1, &read) != 0; --waiting)
    if (event.EventType == KEY_EVENT && event.Event.KeyEvent.bKeyDown != 0 &&
        event.Event.KeyEvent.uChar.UnicodeChar != 0)
      text += event.Event.KeyEvent.uChar.UnicodeChar;
  return narrow(text);
}

}  // namespace clamor
