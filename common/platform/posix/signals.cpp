// signals.cpp: signals by POSIX.
#include "common/platform/signals.h"

#include <array>
#include <atomic>

#include <poll.h>
#include <signal.h>
#include <unistd.h>

namespace clamor {

namespace {

constexpr std::array<int, 4> kNumbers = {SIGINT, SIGTERM, SIGHUP, SIGPIPE};  // by SystemSignal
std::array<std::atomic<void (*)(SystemSignal)>, kNumbers.size()> handlers{};

int number_of(SystemSignal signal) { return kNumbers[static_cast<std::size_t>(signal)]; }

void call_handler(int number) {
  for (std::size_t i = 0; i < kNumbers.size(); ++i)
    if (kNumbers[i] == number) handlers[i].load()(static_cast<SystemSignal>(i));
}

}  // namespace

struct SignalHandlers::Saved {
  int number = 0;
  std::size_t which = 0;                    // of `handlers`
  void (*handler)(SystemSignal) = nullptr;  // the previous one, if any
  struct sigaction action {};
};

SignalHandlers::SignalHandlers() = default;

SignalHandlers::~SignalHandlers() {
  for (const Saved& saved : saved_) {
    ::sigaction(saved.number, &saved.action, nullptr);
    if (saved.handler != nullptr) handlers[saved.which] = saved.handler;
  }
}

void SignalHandlers::handle(SystemSignal signal, void (*handler)(SystemSignal)) {
  const auto which = static_cast<std::size_t>(signal);
  const int number = kNumbers[which];
  Saved saved{number, which, handlers[which], {}};
  ::sigaction(number, nullptr, &saved.action);
  if (signal == SystemSignal::kHangUp && saved.action.sa_handler == SIG_IGN) return;
  saved_.push_back(saved);
  handlers[which] = handler;
  struct sigaction action {};
  action.sa_handler = call_handler;
  action.sa_flags = SA_RESTART;
  ::sigaction(number, &action, nullptr);
}

void SignalHandlers::heed_children() {
  saved_.push_back({.number = SIGCHLD});
  struct sigaction action {};
  action.sa_handler = SIG_DFL;
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGCHLD, &action, &saved_.back().action);
}

void block_broken_pipes() {
  sigset_t blocked;
  ::sigemptyset(&blocked);
  ::sigaddset(&blocked, SIGPIPE);
  ::pthread_sigmask(SIG_BLOCK, &blocked, nullptr);
}

void end_program(std::string_view message, int exit_code) {
  [[maybe_unused]] const auto ignored = ::write(STDERR_FILENO, message.data(), message.size());
  ::_exit(exit_code);
}

void end_program_by(SystemSignal signal) {
  ::signal(number_of(signal), SIG_DFL);
  ::raise(number_of(signal));
}

bool output_reader_is_gone() {
  std::array<pollfd, 2> outputs{{{STDOUT_FILENO, POLLOUT, 0}, {STDERR_FILENO, POLLOUT, 0}}};
  if (::poll(outputs.data(), outputs.size(), 0) <= 0) return false;
  for (const pollfd& output : outputs)
    if ((output.revents & POLLERR) != 0) return true;
  return false;
}

}  // namespace clamor
