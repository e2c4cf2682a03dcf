#include "tools/program/interrupt.h"

#include <cassert>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <ctime>
#include <mutex>

#include <poll.h>
#include <unistd.h>

#include "tools/program/exit_codes.h"

namespace clamor {

namespace {

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

void on_signal(int number) {
  const std::int64_t now = clock_of_signals.load()();
  std::int64_t first = kNever;
  const bool is_first = interrupted_at_ms.compare_exchange_strong(first, now);
  interrupted = true;
  if (is_first || number == SIGHUP || now - first < kOneRequestMs) return;
  std::signal(number, SIG_DFL);
  std::raise(number);
}

// A broken connection to a sound server also raises SIGPIPE, and is no reason to end.
void on_broken_pipe(int) {
  if (output_reader_is_gone()) interrupted = true;
}

void stop_at_once(int) {
  const ssize_t ignored = ::write(STDERR_FILENO, sentence.data(), sentence.size());
  (void)ignored;
  ::_exit(kInterrupted);
}

}  // namespace

void SavedSignalHandlers::handle(int number, void (*handler)(int)) {
  assert(count_ < saved_.size());
  Saved& saved = saved_[count_];
  saved.number = number;
  ::sigaction(number, nullptr, &saved.action);
  if (number == SIGHUP && saved.action.sa_handler == SIG_IGN) return;
  ++count_;
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  ::sigaction(number, &action, nullptr);
}

SavedSignalHandlers::~SavedSignalHandlers() {
  for (std::size_t i = 0; i < count_; ++i)
    ::sigaction(saved_[i].number, &saved_[i].action, nullptr);
}

std::int64_t monotonic_ms() {
  timespec now;
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1000 + now.tv_nsec / 1'000'000;
}

Interrupt::Interrupt(Clock clock) {
  clock_of_signals = clock;
  forget();
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) signals_.handle(number, on_signal);
  signals_.handle(SIGPIPE, on_broken_pipe);
}

const std::atomic<bool>& Interrupt::requested() { return interrupted; }

void Interrupt::forget() {
  interrupted = false;
  interrupted_at_ms = kNever;
}

bool output_reader_is_gone() {
  std::array<pollfd, 2> outputs{{{STDOUT_FILENO, POLLOUT, 0}, {STDERR_FILENO, POLLOUT, 0}}};
  if (::poll(outputs.data(), outputs.size(), 0) <= 0) return false;
  for (const pollfd& output : outputs)
    if ((output.revents & POLLERR) != 0) return true;
  return false;
}

ExitOnSignal::ExitOnSignal(const std::string& command) {
  sentence = (::isatty(STDERR_FILENO) != 0 ? "\nclamor " : "clamor ") + command +
             ": stopped; nothing was written\n";
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) signals_.handle(number, stop_at_once);
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
        const ssize_t ignored = ::write(STDERR_FILENO, line.data(), line.size());
        (void)ignored;
        ::_exit(kInterrupted);
      }) {}

}  // namespace clamor
