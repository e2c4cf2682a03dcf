#include "tools/program/terminal.h"

#include <array>
#include <cctype>
#include <chrono>
#include <string_view>
#include <thread>

namespace clamor {

namespace {

struct Sequence {
  std::string_view text;
  Key key;
};
// Arrow keys in both encodings that terminals use, and the usual letters of games.
constexpr std::array<Sequence, 20> kSequences = {{{"\x1b[A", Key::kForward},
                                                  {"\x1b[B", Key::kBack},
                                                  {"\x1b[C", Key::kTurnRight},
                                                  {"\x1b[D", Key::kTurnLeft},
                                                  {"\x1bOA", Key::kForward},
                                                  {"\x1bOB", Key::kBack},
                                                  {"\x1bOC", Key::kTurnRight},
                                                  {"\x1bOD", Key::kTurnLeft},
                                                  {"\x1b[5~", Key::kUp},
                                                  {"\x1b[6~", Key::kDown},
                                                  {"w", Key::kForward},
                                                  {"s", Key::kBack},
                                                  {"a", Key::kTurnLeft},
                                                  {"d", Key::kTurnRight},
                                                  {",", Key::kLeft},
                                                  {".", Key::kRight},
                                                  {"r", Key::kUp},
                                                  {"f", Key::kDown},
                                                  {"q", Key::kQuit},
                                                  {"\x03", Key::kQuit}}};

}  // namespace

Key Terminal::read(int milliseconds) {
  if (!is_terminal()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
    return Key::kNone;
  }
  if (pending_.empty()) {
    const auto bytes = input_.read(milliseconds);
    if (!bytes) return Key::kQuit;  // the terminal was closed
    if (bytes->empty()) return Key::kNone;
    pending_ = *bytes;
  }
  if (pending_ == "\x1b") {  // a lone Escape
    pending_.clear();
    return Key::kQuit;
  }
  for (const Sequence& sequence : kSequences) {
    std::string start = pending_.substr(0, sequence.text.size());
    if (start.size() == 1)
      start[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(start[0])));
    if (start != sequence.text) continue;
    pending_.erase(0, sequence.text.size());
    return sequence.key;
  }
  pending_.erase(0, 1);
  return Key::kNone;
}

}  // namespace clamor
