// child_process.cpp: child processes by fork().
#include "common/platform/child_process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <new>

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "common/memory_size.h"
#include "common/platform/posix/retry_on_eintr.h"
#include "common/system_reason.h"

namespace clamor {

namespace {

constexpr int kNoMemory = 3;  // exit code

bool write_all(int to, const void* bytes, std::size_t count) {
  return transfer_all(count, [&](std::size_t at, std::size_t left) {
    return ::write(to, static_cast<const char*>(bytes) + at, left);
  });
}

using Clock = std::chrono::steady_clock;

// Returns false at the deadline.
bool read_all(int from, void* bytes, std::size_t count, Clock::time_point deadline) {
  return transfer_all(count, [&](std::size_t at, std::size_t left) -> ssize_t {
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    pollfd ready{from, POLLIN, 0};
    if (const ssize_t count_ready =
            ::poll(&ready, 1, static_cast<int>(std::max<std::int64_t>(wait.count(), 0)));
        count_ready <= 0)
      return count_ready;
    return ::read(from, static_cast<char*>(bytes) + at, left);
  });
}

// Bytes that this process has mapped, which a forked child inherits.
std::uint64_t address_space_bytes() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

void limit(int resource, std::uint64_t most) {
  rlimit limits{};
  if (::getrlimit(static_cast<__rlimit_resource_t>(resource), &limits) != 0) return;
  limits.rlim_cur = std::min<rlim_t>(most, limits.rlim_max);
  limits.rlim_max = std::min<rlim_t>(
      most + 1, limits.rlim_max);  // the hard limit kills without a signal to handle
  ::setrlimit(static_cast<__rlimit_resource_t>(resource), &limits);
}

// Detaches the child from the parent's signal handlers and terminal, and sets its limits.
void be_alone(const ChildLimits& limits, std::uint64_t bytes_before) {
  for (const int number : {SIGSEGV, SIGBUS, SIGABRT, SIGILL, SIGFPE, SIGXCPU, SIGPIPE, SIGALRM,
                           SIGINT, SIGTERM, SIGHUP, SIGQUIT})
    ::signal(number, SIG_DFL);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // ends hanging work if the parent dies
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  if (const int nowhere = ::open("/dev/null", O_RDWR); nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.cpu_s);
  if (bytes_before > 0) limit(RLIMIT_AS, bytes_before + limits.memory_bytes);
}

[[noreturn]] void run(int to, const std::function<std::vector<std::byte>()>& work) {
  int code = 0;
  try {
    const std::vector<std::byte> result = work();
    const std::uint64_t size = result.size();
    write_all(to, &size, sizeof size) && write_all(to, result.data(), result.size());
  } catch (const std::bad_alloc&) {
    code = kNoMemory;
  }
  ::_exit(code);  // skips the exit handlers of the parent
}

}  // namespace

Result<std::vector<std::byte>> in_child_process(
    const ChildLimits& limits, const std::function<std::vector<std::byte>()>& work) {
  const auto failed = [](const char* what) {
    return Error(std::string("cannot be read in a child process (") + what + ": " +
                 system_reason(errno) + ")");
  };
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) return failed("pipe");
  const std::uint64_t bytes_before = address_space_bytes();
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(pipe[0]);
    be_alone(limits, bytes_before);
    run(pipe[1], work);
  }
  ::close(pipe[1]);
  if (child < 0) {
    const Error error = failed("fork");
    ::close(pipe[0]);
    return error;
  }
  // Reads `size` bytes rather than up to the end of the pipe, whose write end a concurrently forked
  // child may also hold.
  std::vector<std::byte> result;
  std::uint64_t size = 0;
  const auto deadline = Clock::now() + std::chrono::seconds(limits.wall_s);
  bool whole = read_all(pipe[0], &size, sizeof size, deadline);
  const bool is_too_large = whole && size > limits.max_result_bytes;
  if (whole && !is_too_large) {
    result.resize(memory_size(size));
    whole = read_all(pipe[0], result.data(), result.size(), deadline);
  }
  const bool is_late = !whole && !is_too_large && Clock::now() >= deadline;
  if (is_late) ::kill(child, SIGKILL);
  ::close(pipe[0]);
  int status = 0;
  const bool known = retry_on_eintr([&] { return ::waitpid(child, &status, 0); }) == child;
  if (is_too_large) return Error("returns more data than allowed");
  if (whole) return result;
  if (is_late) return Error("takes more than " + std::to_string(limits.wall_s) + " s to read");
  if (known && WIFSIGNALED(status) &&
      (WTERMSIG(status) == SIGINT || WTERMSIG(status) == SIGTERM || WTERMSIG(status) == SIGHUP))
    return Error("was not read completely because the program was stopped");
  if (known && WIFEXITED(status) && WEXITSTATUS(status) == kNoMemory)
    return Error("needs more memory than allowed");
  if (known && WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
    return Error("takes more than " + std::to_string(limits.cpu_s) + " s to read");
  return Error("crashes the library that reads it");
}

}  // namespace clamor
