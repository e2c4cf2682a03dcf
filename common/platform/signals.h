// signals.h: signals that end a program, and what it does about them.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace clamor {

enum class SystemSignal : std::uint8_t { kInterrupt, kTerminate, kHangUp, kBrokenPipe };

// Handles signals during its lifetime, then restores their handlers.
class SignalHandlers {
 public:
  SignalHandlers();
  ~SignalHandlers();
  SignalHandlers(const SignalHandlers&) = delete;
  SignalHandlers& operator=(const SignalHandlers&) = delete;

  // An ignored kHangUp stays ignored, as under nohup.
  void handle(SystemSignal signal, void (*handler)(SystemSignal));

  // Where the end of child processes is ignored, nothing tells of them.
  void heed_children();

 private:
  struct Saved;

  std::vector<Saved> saved_;
};

// From now on, writing to a connection whose other end is gone raises no signal in the calling
// thread, nor in threads that it starts: the write fails.
void block_broken_pipes();

// Signal handlers may call these.
[[noreturn]] void end_program(std::string_view message, int exit_code);  // to standard error
void end_program_by(SystemSignal signal);

// Whether standard output or error is a pipe without a reader.
bool output_reader_is_gone();

}  // namespace clamor
