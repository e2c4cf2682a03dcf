// interrupt.h: Ctrl-C, a closed terminal and a reader that has gone end a command in order.
#pragma once

#include <array>
#include <atomic>
#include <string>

#include <signal.h>

namespace clamor {

// What signals did before, and will do again when this goes.
class SavedSignalHandlers {
 public:
  SavedSignalHandlers() = default;
  ~SavedSignalHandlers();
  SavedSignalHandlers(const SavedSignalHandlers&) = delete;
  SavedSignalHandlers& operator=(const SavedSignalHandlers&) = delete;

  // Handlers of SIGHUP are left as they are where it is ignored, as under nohup.
  void handle(int number, void (*handler)(int));

 private:
  struct Saved {
    int number = 0;
    struct sigaction action {};
  };
  std::array<Saved, 4> saved_;
  std::size_t count_ = 0;
};

// While it lives, SIGINT, SIGTERM, SIGHUP, and SIGPIPE where nobody reads standard output or error
// any more, set requested(). A second SIGINT or SIGTERM ends the program at once.
class Interrupt {
 public:
  Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  static const std::atomic<bool>& requested();

 private:
  SavedSignalHandlers signals_;
};

// Whether standard output or error is a pipe whose reader has gone.
bool output_reader_is_gone();

// While it lives, SIGINT, SIGTERM and SIGHUP end the program at once, with exit code 1 and a
// sentence on standard error. For work that has made nothing that would have to be removed.
class ExitOnSignal {
 public:
  explicit ExitOnSignal(const std::string& command);
  ExitOnSignal(const ExitOnSignal&) = delete;
  ExitOnSignal& operator=(const ExitOnSignal&) = delete;

 private:
  SavedSignalHandlers signals_;
};

}  // namespace clamor
