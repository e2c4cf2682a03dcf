// Tests the program on a terminal: lines that are redrawn fit its width, warnings have a colour.
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <regex>

#include <gmock/gmock.h>
#include <poll.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/wait.h>

#include "tests/tools/run_clamor.h"

namespace clamor {
namespace {

using testing::clamor;
using ::testing::EndsWith;
using testing::Folder;
using ::testing::HasSubstr;
using ::testing::Not;

// The program in a process of its own, on a pseudo-terminal.
class OnTerminal {
 public:
  OnTerminal(std::vector<std::string> words, unsigned short columns,
             const char* no_color = nullptr) {
    words.insert(words.begin(), testing::kProgram);
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    winsize size{24, columns, 0, 0};
    id_ = ::forkpty(&terminal_, nullptr, nullptr, &size);
    if (id_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::setenv("TERM", "xterm", 1);
    ::unsetenv("NO_COLOR");
    if (no_color != nullptr) ::setenv("NO_COLOR", no_color, 1);
    ::execv(pointers[0], pointers.data());
    ::_exit(127);
  }
  ~OnTerminal() {
    if (id_ > 0) {
      ::kill(id_, SIGKILL);
      ::waitpid(id_, nullptr, 0);
    }
    ::close(terminal_);
  }

  void resize(unsigned short columns) {
    const winsize size{24, columns, 0, 0};
    ::ioctl(terminal_, TIOCSWINSZ, &size);
  }
  void type(const char* keys) const { ASSERT_EQ(::write(terminal_, keys, std::strlen(keys)), 1); }

  // Waits for the next line that is redrawn, and returns it, or nothing at the end.
  std::optional<std::string> redrawn() {
    static const std::regex kRedrawn("\r([^\r\n\x1b]+)\x1b\\[K");
    std::smatch found;
    while (!std::regex_search(unread_, found, kRedrawn))
      if (!read()) return std::nullopt;
    std::string line = found[1];
    unread_ = found.suffix();
    return line;
  }

  // Everything until the program ends.
  const std::string& rest() {
    while (read()) {
    }
    return all_;
  }

 private:
  // A terminal that is closed is read with an error.
  bool read() {
    constexpr int kTooLong_ms = 120'000;
    pollfd ready{terminal_, POLLIN, 0};
    std::array<char, 4096> bytes;
    if (::poll(&ready, 1, kTooLong_ms) <= 0) return false;
    const auto count = ::read(terminal_, bytes.data(), bytes.size());
    if (count <= 0) return false;
    unread_.append(bytes.data(), static_cast<std::size_t>(count));
    all_.append(bytes.data(), static_cast<std::size_t>(count));
    return true;
  }

  pid_t id_ = -1;
  int terminal_ = -1;
  std::string all_, unread_;
};

// Whether the lines that come after a change of the width fit, and how long they are.
std::size_t longest_of_next(OnTerminal& terminal, std::size_t columns) {
  std::size_t longest = 0;
  int lines = 0;
  while (lines < 3) {
    const auto line = terminal.redrawn();
    if (!line) break;
    // Lines that were on their way have the width of before.
    if (lines == 0 && line->size() >= columns) continue;
    longest = std::max(longest, line->size());
    ++lines;
  }
  EXPECT_EQ(lines, 3) << "no line fits " << columns << " columns: " << terminal.rest();
  return longest;
}

TEST(Terminal, HasTheProgressOfABakeOnOneLineOfAnyWidth) {
  const Folder folder;
  OnTerminal terminal({"bake", testing::violin_room(), "-o", folder / "a.clamor", "--photons",
                       "200000000", "--sources", "1000", "--threads", "1", "--no-journal"},
                      80);
  EXPECT_LT(longest_of_next(terminal, 80), 80u);
  for (const unsigned short columns : {40, 20}) {
    terminal.resize(columns);
    const std::size_t longest = longest_of_next(terminal, columns);
    EXPECT_LT(longest, columns);
  }
  terminal.resize(120);
  // More room shows more again.
  for (auto line = terminal.redrawn();; line = terminal.redrawn()) {
    ASSERT_TRUE(line.has_value()) << terminal.rest();
    ASSERT_LT(line->size(), 120u);
    if (line->find("% escaped") != std::string::npos) break;
  }
  terminal.type("\x03");
  EXPECT_THAT(terminal.rest(), HasSubstr("stopped; nothing was written"));
}

TEST(Terminal, HasTheStatusOfAPlayerOnOneLineOfAnyWidth) {
  const Folder folder;
  const auto empty = folder.write("void.gltf", testing::kEmptyLevel);
  const std::string file = folder / "a.clamor";
  ASSERT_EQ(clamor({"bake", empty, "-o", file, "--emitter", "name=hiss,signal=noise,at=0,0,0",
                    "--no-journal"})
                .code,
            0);
  OnTerminal terminal({"play", file, "--device", "none", "--loudspeakers"}, 80);
  EXPECT_LT(longest_of_next(terminal, 80), 80u);
  terminal.resize(40);
  EXPECT_LT(longest_of_next(terminal, 40), 40u);
  terminal.resize(250);
  for (auto line = terminal.redrawn();; line = terminal.redrawn()) {
    ASSERT_TRUE(line.has_value()) << terminal.rest();
    if (line->find("held") != std::string::npos) break;
  }
  terminal.type("q");
  // The summary replaces the line.
  EXPECT_THAT(terminal.rest(), HasSubstr("\r\x1b[Kplayed "));
}

TEST(Terminal, ShowsWarningsAndErrorsInColour) {
  const Folder folder;
  const auto words = [&](const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> all = {"bake",
                                    testing::violin_room(),
                                    "-o",
                                    folder / name,
                                    "--photons",
                                    "100",
                                    "--no-journal",
                                    "--emitter",
                                    "name=violin,signal=noise,at=44,1.5,0"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  const std::string yellow = "\x1b[1;33m", red = "\x1b[1;31m", plain = "\x1b[0m";
  OnTerminal warned(words("a.clamor", {}), 80);
  EXPECT_THAT(warned.rest(), HasSubstr(yellow + "  warning" + plain + "  emitter 'violin'"));
  EXPECT_THAT(warned.rest(),
              EndsWith("  done     with " + yellow + "1 warning above" + plain + "\r\n"));
  OnTerminal failed({"inspect", folder / "none.clamor"}, 80);
  EXPECT_THAT(failed.rest(), HasSubstr(red + "clamor inspect:" + plain));

  OnTerminal without(words("b.clamor", {}), 80, "1");
  EXPECT_THAT(without.rest(), EndsWith("  done     with 1 warning above\r\n"));
  OnTerminal never(words("c.clamor", {"--color", "never"}), 80);
  EXPECT_THAT(never.rest(), Not(HasSubstr("\x1b[1;")));
  // A pipe has no colours, unless it is asked for.
  EXPECT_THAT(clamor(words("d.clamor", {})).err, Not(HasSubstr("\x1b")));
  EXPECT_THAT(clamor(words("e.clamor", {"--color", "always"})).err, HasSubstr(yellow));
  const auto wrong = clamor(words("f.clamor", {"--color", "blue"}));
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--color must be auto, always or never, not 'blue'"));
}

TEST(Terminal, HasHelpThatFitsIt) {
  for (const unsigned short columns : {40, 80, 100}) {
    OnTerminal terminal({"play", "--help"}, columns);
    std::istringstream lines(terminal.rest());
    std::size_t longest = 0;
    for (std::string line; std::getline(lines, line);) longest = std::max(longest, line.size() - 1);
    EXPECT_LE(longest, columns);
    EXPECT_GE(longest, columns - 8u);
  }
}

// Lines may be longer than the terminal is wide only where they have no blank to break at.
TEST(Help, OfEveryCommandFitsTheColumnsThatThereAre) {
  for (const std::string command :
       {"", "bake", "merge", "farm", "inspect", "report", "diff", "play", "view", "bench", "render",
        "impulse", "compare", "experiment", "materials", "devices"})
    for (const std::size_t columns : {40u, 80u, 100u}) {
      ::setenv("COLUMNS", std::to_string(columns).c_str(), 1);
      std::vector<std::string> words = {command, "--help"};
      if (command.empty()) words = {"--help"};
      const auto help = clamor(words);
      ::unsetenv("COLUMNS");
      ASSERT_EQ(help.code, 0);
      std::istringstream lines(help.out);
      for (std::string line; std::getline(lines, line);) {
        if (line.size() <= columns) continue;
        const std::string text = line.substr(line.find_first_not_of(' '));
        EXPECT_EQ(text.substr(0, text.find(" \\")).find(' '), std::string::npos)
            << columns << " columns: " << line;
      }
      EXPECT_THAT(help.out, HasSubstr("\nexample: clamor "));
    }
}

}  // namespace
}  // namespace clamor
