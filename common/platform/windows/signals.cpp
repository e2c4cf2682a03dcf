// signals.cpp: what a console tells its programs.
#include "common/platform/signals.h"

#include <array>
#include <atomic>
#include <cstdlib>

#include "common/platform/windows/win32.h"

namespace clamor {

namespace {

std::array<std::atomic<void (*)(SystemSignal)>, 4> handlers{};  // by SystemSignal

// Windows calls it on a thread of its own. After the console was closed, the program ends when it
// returns, or five seconds later.
BOOL WINAPI call_handler(DWORD event) {
  constexpr DWORD kTimeToEnd_ms = 10'000;
  const SystemSignal signal = event == CTRL_C_EVENT       ? SystemSignal::kInterrupt
                              : event == CTRL_BREAK_EVENT ? SystemSignal::kTerminate
                                                          : SystemSignal::kHangUp;
  const auto handler = handlers[static_cast<std::size_t>(signal)].load();
  if (handler == nullptr) return FALSE;
  handler(signal);
  if (signal == SystemSignal::kHangUp) ::Sleep(kTimeToEnd_ms);
  return TRUE;
}

}  // namespace

struct SignalHandlers::Saved {
  std::size_t which = 0;  // of `handlers`
  void (*handler)(SystemSignal) = nullptr;
};

SignalHandlers::SignalHandlers() = default;

SignalHandlers::~SignalHandlers() {
  for (const Saved& saved : saved_) handlers[saved.which] = saved.handler;
}

void SignalHandlers::handle(SystemSignal signal, void (*handler)(SystemSignal)) {
  [[maybe_unused]] static const BOOL registered = ::SetConsoleCtrlHandler(call_handler, TRUE);
  const auto which = static_cast<std::size_t>(signal);
  saved_.push_back({which, handlers[which].exchange(handler)});
}

void SignalHandlers::heed_children() {}

void block_broken_pipes() {}

void end_program(std::string_view message, int exit_code) {
  DWORD written = 0;
  ::WriteFile(::GetStdHandle(STD_ERROR_HANDLE), message.data(), static_cast<DWORD>(message.size()),
              &written, nullptr);
  ::_exit(exit_code);
}

void end_program_by(SystemSignal) {
  constexpr UINT kByControlC = 0xC000013A;
  ::TerminateProcess(::GetCurrentProcess(), kByControlC);
}

// The next write tells.
bool output_reader_is_gone() { return false; }

}  // namespace clamor
