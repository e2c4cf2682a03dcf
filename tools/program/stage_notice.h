// stage_notice.h: names a stage of long work that says nothing itself, once it has lasted two
// seconds.
//
// Threads: one; a thread of its own prints, unless hold() keeps it back.
#pragma once

#include <chrono>
#include <condition_variable>
#include <iosfwd>
#include <mutex>
#include <string>
#include <thread>

namespace clamor {

class StageNotice {
 public:
  explicit StageNotice(std::ostream& err,
                       std::chrono::milliseconds after = std::chrono::seconds(2));

  // Ends the stage before.
  void begin(std::string stage);
  void end() { begin(""); }

  // Nothing is printed while the lock lives, so that others can print.
  [[nodiscard]] std::unique_lock<std::mutex> hold() { return std::unique_lock(mutex_); }

 private:
  void watch(const std::stop_token& ended);

  std::ostream& err_;
  const std::chrono::milliseconds after_;
  std::mutex mutex_;  // guards the stream and what follows
  std::condition_variable_any changed_;
  std::string stage_;  // that is not named yet; "": none
  std::chrono::steady_clock::time_point since_;
  std::jthread thread_;  // stopped and joined first
};

}  // namespace clamor
