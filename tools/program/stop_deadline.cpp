#include "tools/program/stop_deadline.h"

#include <chrono>
#include <condition_variable>
#include <mutex>

#include <unistd.h>

#include "tools/program/exit_codes.h"
#include "tools/program/interrupt.h"

namespace clamor {

namespace {

constexpr auto kLooksForInterrupt = std::chrono::milliseconds(50);
constexpr auto kToEnd = std::chrono::milliseconds(600);

}  // namespace

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
