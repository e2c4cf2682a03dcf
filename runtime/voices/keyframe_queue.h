// keyframe_queue.h: a lock-free queue of keyframes from the sampler to the mixer.
//
// A ring buffer of keyframes that are allocated once. The writer fills the next free keyframe in
// place and publishes it; the reader reads the oldest in place and releases it. Neither waits, and
// nothing is copied.
//
// Threads: writable() and publish() on one thread, readable() and release() on one other; size() on
// both.
#pragma once

#include <atomic>
#include <cassert>
#include <cstddef>
#include <vector>

#include "runtime/realtime/realtime.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

class KeyframeQueue {
 public:
  KeyframeQueue(std::size_t keyframes, std::size_t voices) : ring_(keyframes) {
    assert(keyframes > 0);
    for (Keyframe& keyframe : ring_) keyframe.voices.reserve(voices);
  }

  // The next free keyframe, or null if all are waiting to be read.
  Keyframe* writable() noexcept REALTIME {
    const std::size_t written = written_.load(std::memory_order_relaxed);
    if (written - read_.load(std::memory_order_acquire) == ring_.size()) return nullptr;
    return &ring_[written % ring_.size()];
  }
  void publish() noexcept REALTIME {
    written_.store(written_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  // The oldest keyframe that is not released, or null.
  const Keyframe* readable() noexcept REALTIME {
    const std::size_t read = read_.load(std::memory_order_relaxed);
    if (written_.load(std::memory_order_acquire) == read) return nullptr;
    return &ring_[read % ring_.size()];
  }
  void release() noexcept REALTIME {
    read_.store(read_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  // Number of keyframes published and not released. The other thread may be changing it.
  std::size_t size() const noexcept REALTIME {
    const std::size_t read = read_.load(std::memory_order_acquire);
    return written_.load(std::memory_order_acquire) - read;
  }

 private:
  std::vector<Keyframe> ring_;
  alignas(64) std::atomic<std::size_t> written_{0};  // written by the writer only
  alignas(64) std::atomic<std::size_t> read_{0};     // written by the reader only
};

}  // namespace clamor
