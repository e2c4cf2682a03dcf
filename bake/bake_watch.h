// bake_watch.h: runs a bake on a thread of its own while the calling thread reports on it, so that
// an application's callbacks run where the application called.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "bake/bake_observer.h"
#include "bake/bake_options.h"

namespace clamor {

enum class BakePhase : std::uint8_t { kPreparing, kTracing, kSorting, kWriting };

struct BakeMessage {
  bool is_warning = false;
  std::string text;
};

class BakeWatch final : public BakeObserver {
 public:
  // Both run on the calling thread and may be empty.
  struct Callbacks {
    // Returns false to stop the bake.
    std::function<bool(BakePhase, const BakeProgress&, double seconds, double tracing_s)> progress;
    std::function<void(const BakeMessage&)> message;
  };

  explicit BakeWatch(Callbacks callbacks) : callbacks_(std::move(callbacks)) {}

  // Returns when `work` has ended, and throws what it throws. A callback that throws stops it.
  void run(const std::function<void()>& work);

  const std::atomic<bool>& stop() const { return stop_; }
  const std::string& first_warning() const { return first_warning_; }  // after run()
  double seconds() const;

  void on_import(const std::string& level, const ImportReport& report) override;
  void on_prepared(const LevelReport& report) override;
  void on_warning(const std::string& text) override;
  void on_progress(const BakeProgress& progress) override;
  void on_writing() override;

 private:
  using Clock = std::chrono::steady_clock;

  void tell(bool is_warning, const std::string& text);
  void report();

  const Callbacks callbacks_;
  const Clock::time_point begun_ = Clock::now();
  std::atomic<bool> stop_ = false;
  std::string first_warning_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  bool ended_ = false;
  BakePhase phase_ = BakePhase::kPreparing;
  BakeProgress progress_;
  Clock::time_point tracing_begun_ = begun_;
  double tracing_s_ = 0;  // at the last progress
  std::vector<BakeMessage> messages_;
};

}  // namespace clamor
