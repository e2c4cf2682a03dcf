#include "tools/program/interrupt.h"

#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "common/platform/terminal.h"
#include "tools/program/exit_codes.h"

namespace clamor {

namespace {

constexpr std::array kStops = {SystemSignal::kInterrupt, SystemSignal::kTerminate,
                               SystemSignal::kHangUp};
std::atomic<bool> interrupted{false};
constexpr std::int64_t kNever = -1;
std::atomic<std::int64_t> interrupted_at_ms{kNever};
std::atomic<Interrupt::Clock> clock_of_signals{monotonic_ms};
std::string sentence;  // message of ExitOnSignal; constant while its handler is installed

// GNU timeout and job schedulers signal a program and then its process group, so that it gets two
// signals for one request.
constexpr std::int64_t kOneRequestMs = 500;

// StopDeadline looks for an interrupt this often, and gives the program this long to end.
constexpr auto kLooksForInterrupt = std::chrono::milliseconds(50);
constexpr auto kToEnd = std::chrono::milliseconds(600);

void on_signal(SystemSignal signal) {
  const std::int64_t now = clock_of_signals.load()();
  std::int64_t first = kNever;
  const bool is_first = interrupted_at_ms.compare_exchange_strong(first, now);
  interrupted = true;
  if (is_first || signal == SystemSignal::kHangUp || now - first < kOneRequestMs) return;
  end_program_by(signal);
}

// A broken connection to a sound server also raises SIGPIPE, and is no reason to end.
void on_broken_pipe(SystemSignal) {
  if (output_reader_is_gone()) interrupted = true;
}

void stop_at_once(SystemSignal) { end_program(sentence, kInterrupted); }

}  // namespace

std::int64_t monotonic_ms() {
  return std::chrono::floor<std::chrono::milliseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

Interrupt::Interrupt(Clock clock) {
  clock_of_signals = clock;
  forget();
  for (const SystemSignal signal : kStops) signals_.handle(signal, on_signal);
  signals_.handle(SystemSignal::kBrokenPipe, on_broken_pipe);
}

const std::atomic<bool>& Interrupt::requested() { return interrupted; }

void Interrupt::forget() {
  interrupted = false;
  interrupted_at_ms = kNever;
}

ExitOnSignal::ExitOnSignal(const std::string& command) {
  sentence =
      (is_terminal(2) ? "\nclamor " : "clamor ") + command + ": stopped; nothing was written\n";
  for (const SystemSignal signal : kStops) signals_.handle(signal, stop_at_once);
}

StopDeadline::StopDeadline(const std::string& sentence)
    : thread_([line = sentence + "\n"](const std::stop_token& ended) {
        std::mutex mutex;
        std::condition_variable_any never;
        std::unique_lock lock(mutex);
        const auto wait = [&](std::chrono::milliseconds time) {
          never.wait_for(lock, ended, time, [] { return false; });
          return !ended.stop_requested();
        };
        while (!Interrupt::requested())
          if (!wait(kLooksForInterrupt)) return;
        if (!wait(kToEnd)) return;
        end_program(line, kInterrupted);
      }) {}

}  // namespace clamor
