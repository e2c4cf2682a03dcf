// bus_error_guard.cpp: the guard by a handler of SIGBUS.
#include "common/platform/bus_error_guard.h"

#include <atomic>
#include <cerrno>
#include <cstdint>

#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

namespace clamor {

namespace {

// The initial-exec model guarantees that access does not allocate, which the handler must not do.
[[gnu::tls_model("initial-exec")]] constinit thread_local BusErrorGuard* innermost = nullptr;

const std::size_t system_page_bytes = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));

const sigset_t bus_error = [] {
  sigset_t set;
  ::sigemptyset(&set);
  ::sigaddset(&set, SIGBUS);
  return set;
}();

struct sigaction previous;  // constant once the handler is installed

// Performs the action that was in place before our handler.
void pass_on(int signal, siginfo_t* information, void* context) {
  if ((previous.sa_flags & SA_SIGINFO) != 0)
    return previous.sa_sigaction(signal, information, context);
  const bool was_sent = information->si_code <= 0;  // by a process rather than a failed access
  if (previous.sa_handler != SIG_DFL && previous.sa_handler != SIG_IGN)
    return previous.sa_handler(signal);
  if (previous.sa_handler == SIG_IGN && was_sent) return;
  // A failed access is repeated when the handler returns, and terminates the program even if the
  // signal was ignored.
  struct sigaction standard {};
  standard.sa_handler = SIG_DFL;
  ::sigaction(signal, &standard, nullptr);
  if (was_sent) ::raise(signal);
}

void handle(int signal, siginfo_t* information, void* context) {
  const int error_before = errno;
  const bool is_failed_access = information->si_code > 0;
  const bool is_handled =
      is_failed_access && BusErrorGuard::replace_for_thread(information->si_addr);
  errno = error_before;
  if (!is_handled) pass_on(signal, information, context);
}

}  // namespace

bool BusErrorGuard::replace_for_thread(void* address) {
  for (BusErrorGuard* guard = innermost; guard != nullptr; guard = guard->outer_)
    if (guard->replace(address)) return true;
  return false;
}

std::span<std::byte> whole_pages(std::span<std::byte> bytes) {
  const std::size_t before = reinterpret_cast<std::uintptr_t>(bytes.data()) % system_page_bytes;
  const std::size_t size = before + bytes.size();
  return {bytes.data() - before,
          (size + system_page_bytes - 1) / system_page_bytes * system_page_bytes};
}

bool BusErrorGuard::install() {
  static const bool installed = [] {
    if (::sigaction(SIGBUS, nullptr, &previous) != 0) return false;
    struct sigaction ours {};
    ours.sa_sigaction = handle;
    ours.sa_mask = previous.sa_mask;
    // Crash reporters expect the alternative stack, where a thread has one.
    ours.sa_flags = SA_SIGINFO | SA_ONSTACK | (previous.sa_flags & (SA_NODEFER | SA_RESTART));
    return ::sigaction(SIGBUS, &ours, nullptr) == 0;
  }();
  return installed;
}

BusErrorGuard::BusErrorGuard(std::span<std::byte> bytes)
    : pages_(whole_pages(bytes)), zeros_begin_(pages_.data() + pages_.size()), outer_(innermost) {
  // A failed access terminates the program if its thread blocks the signal, as threads of games
  // may.
  sigset_t before;
  ::pthread_sigmask(SIG_UNBLOCK, &bus_error, &before);
  was_blocked_ = ::sigismember(&before, SIGBUS) == 1;
  innermost = this;
  std::atomic_signal_fence(std::memory_order_seq_cst);
}

BusErrorGuard::~BusErrorGuard() {
  std::atomic_signal_fence(std::memory_order_seq_cst);
  innermost = outer_;
  if (was_blocked_) ::pthread_sigmask(SIG_BLOCK, &bus_error, nullptr);
}

std::span<std::byte> BusErrorGuard::zeros() const {
  std::atomic_signal_fence(std::memory_order_seq_cst);
  std::byte* const begin = zeros_begin_;
  return {begin, static_cast<std::size_t>(pages_.data() + pages_.size() - begin)};
}

// Maps zeros over the rest of the range, so at most one fault occurs.
bool BusErrorGuard::replace(void* address) {
  std::byte* const end = pages_.data() + pages_.size();
  auto* const failed = static_cast<std::byte*>(address);
  if (failed < pages_.data() || failed >= end) return false;
  std::byte* const begin = whole_pages({failed, 1}).data();
  if (::mmap(begin, static_cast<std::size_t>(end - begin), PROT_READ,
             MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0) == MAP_FAILED)
    return false;
  if (begin < zeros_begin_) zeros_begin_ = begin;
  return true;
}

}  // namespace clamor
