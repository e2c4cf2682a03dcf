#include "runtime/player/render.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

#include "common/platform/thread.h"
#include "runtime/hrtf/hrtf_filter_bank.h"
#include "runtime/mixing/limiter.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

namespace {

constexpr std::uint64_t kBlock_frames = kKeyframeFrames;
constexpr auto kLooksForStop = std::chrono::milliseconds(50);

// Keyframes needed before block n is mixed: 0 to n + 1, between which its voices are interpolated,
// and one more, because filters and limiter run ahead by less than a block. The queue has room for
// one more.
static_assert(kHrtfDelayFrames + kLimiterDelayFrames < kKeyframeFrames);
std::uint64_t keyframes_for(std::uint64_t block) { return block + 3; }

// Makes keyframes ahead of the mixing thread, on a thread of its own, and no more than `total`, so
// that the statistics do not depend on how far ahead it is when mixing ends.
class KeyframesAhead {
 public:
  KeyframesAhead(Auralizer& auralizer, const Walk& walk, std::uint64_t total)
      : thread_([this, &auralizer, &walk, total](const std::stop_token& stop) {
          name_thread("sampler");
          try {
            make(auralizer, walk, total, stop);
          } catch (...) {
            const std::lock_guard lock(mutex_);
            failure_ = std::current_exception();
          }
          changed_.notify_all();
        }) {}

  // Waits until `count` keyframes are made, or all that there is room for. False if stopped.
  // Rethrows exceptions of the thread, such as std::bad_alloc.
  bool wait_for_keyframes(std::uint64_t count, const std::atomic<bool>* stop) {
    std::unique_lock lock(mutex_);
    const auto are_made = [&] { return made_ >= count || full_after_ == mixed_ || failure_; };
    // Poll `stop`, because a signal handler that sets it cannot notify this thread.
    while (!changed_.wait_for(lock, kLooksForStop, are_made))
      if (stop != nullptr && *stop) return false;
    if (failure_) std::rethrow_exception(failure_);
    return stop == nullptr || !*stop;
  }

  // Makes room for more keyframes.
  void mixed_a_block() { count(mixed_); }

 private:
  void make(Auralizer& auralizer, const Walk& walk, std::uint64_t total,
            const std::stop_token& stop) {
    std::uint64_t left = total;
    for (std::uint64_t mixed = 0; left > 0 && !stop.stop_requested();
         mixed = wait_for_room(stop, mixed))
      while (left > 0 && !stop.stop_requested() && auralizer.wants_keyframe()) {
        auralizer.make_keyframe(walk.at(auralizer.next_keyframe_time_s()));
        count(made_);
        --left;
      }
  }

  void count(std::uint64_t& what) {
    const std::lock_guard lock(mutex_);
    ++what;
    changed_.notify_all();
  }

  std::uint64_t wait_for_room(const std::stop_token& stop, std::uint64_t mixed) {
    std::unique_lock lock(mutex_);
    full_after_ = mixed;
    changed_.notify_all();
    changed_.wait(lock, stop, [&] { return mixed_ > mixed; });
    return mixed_;
  }

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::uint64_t made_ = 0, mixed_ = 0;
  std::uint64_t full_after_ = ~std::uint64_t{0};  // blocks
  std::exception_ptr failure_;                    // of the thread
  std::jthread thread_;                           // stopped and joined first
};

}  // namespace

Result<void> render(Auralizer& auralizer, const Walk& walk, std::uint64_t frames,
                    const BlockSink& sink, const std::atomic<bool>* stop) {
  const auto channels = static_cast<std::size_t>(auralizer.channels());
  std::vector<float> block(kBlock_frames * channels);
  if (frames == 0) return {};
  KeyframesAhead keyframes(auralizer, walk, keyframes_for((frames - 1) / kBlock_frames));
  for (std::uint64_t done = 0; done < frames;) {
    if (!keyframes.wait_for_keyframes(keyframes_for(done / kBlock_frames), stop))
      return Error("was stopped");
    const std::uint64_t count = std::min(kBlock_frames, frames - done);
    const std::span<float> part(block.data(), count * channels);
    auralizer.mix(part);
    keyframes.mixed_a_block();
    if (const auto taken = sink(part); !taken.ok()) return taken;
    done += count;
  }
  return {};
}

}  // namespace clamor
