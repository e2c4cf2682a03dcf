// progressive_bake.h: bakes a level in the background in stages, each more exact than the one
// before: the first takes a second or two, the last is the bake that `clamor bake` would make.
//
//   request() -> quick -> better -> final;  another request() stops the stage in progress
//
// If only absorption has changed since a better stage was traced, its photons are re-weighed
// instead (bake/path_cache.h): the stages are then re-weighed -> final. If one emitter has changed,
// the better stage traces only that one. The other stages keep their traced photons in journals,
// which spares tracing as in any bake. Files lie in a folder of the object's own, but for the last
// stage of a request that names an output.
//
// Threads: all functions on one thread; bakes run on another.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bake/bake_request.h"

namespace clamor {

struct BakeCache;

struct BakeStage {
  std::string name;  // "quick", "better" or "final"
  BakeRequest request;
  bool keeps_paths = false;  // for re-weighing
};

// The stages of a request. Without a number of photons the first two have fewer photons and
// sources; with one they are left out if they would not be smaller.
std::vector<BakeStage> stages_of(const BakeRequest& request);

class ProgressiveBake {
 public:
  // A stage that has ended.
  struct Event {
    std::uint64_t request = 0;  // as request() returned it
    std::string stage;
    std::string path;   // of the bake file; "" after an error
    std::string error;  // in a sentence
    bool is_final = false;
    bool is_reweighed = false;  // no photon was traced
    std::string why_traced;     // why photons were traced in the first stage of a request
    double seconds = 0;         // since the request
    std::uint64_t sources = 0;
    double decay_error_db = 0;
    std::vector<std::string> warnings;
  };
  struct Status {
    bool is_busy = false;
    std::string stage;
    double share = 0;    // of the stage's photons
    double seconds = 0;  // since the request
  };

  // `threads`: 0 for all cores. The folder for files is made in the system's folder for temporary
  // files. After start() an Error if that cannot be made.
  explicit ProgressiveBake(int threads = 0);
  ~ProgressiveBake();  // stops, and removes the folder
  Result<void> start();

  // Bakes the request, and cancels what was asked for before. With an output the last stage is
  // written there. `only_last`: without the stages before, which were heard already.
  std::uint64_t request(BakeRequest wanted, std::string output = "", bool only_last = false);
  void cancel();

  // The oldest event that was not told yet.
  std::optional<Event> poll();
  Status status() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Job {
    std::uint64_t number = 0;
    BakeRequest request;
    std::string output;
    bool only_last = false;
    Clock::time_point at;
  };

  class Observer;
  void run(const std::stop_token& ended);
  void serve(const Job& job);
  Event bake(const Job& job, const BakeStage& stage, bool is_first, bool is_last);

  const int threads_;
  std::string folder_;
  std::unique_ptr<BakeCache> cache_;  // used by the thread alone
  std::atomic<bool> stop_{false};  // the stage in progress
  mutable std::mutex mutex_;       // guards what follows
  std::condition_variable_any asked_;
  std::optional<Job> next_;
  std::vector<Event> events_;
  Status status_;
  Clock::time_point requested_{};
  std::uint64_t requests_ = 0, files_ = 0;
  std::jthread thread_;
};

}  // namespace clamor
