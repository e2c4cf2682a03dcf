// keyframe_queue.h: keyframes on their way from the sampler to the mixer, in order.
//
// A ring of keyframes allocated once. The writer fills the next free one in place and publishes it;
// the reader reads the oldest in place and releases it. Neither ever waits, and nothing is copied.
//
// Threads: writable() and publish() on one, readable() and release() on one other; size() on both.
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

  // The next free keyframe, or null when all are waiting to be read.
  Keyframe* writable() noexcept REALTIME {
    const std::size_t written = written_.load(std::memory_order_relaxed);
    if (written - read_.load(std::memory_order_acquire) == ring_.size()) return nullptr;
    return &ring_[written % ring_.size()];
  }
  void publish() noexcept REALTIME {
    written_.store(written_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  // The oldest keyframe not yet released, or null when there is none.
  const Keyframe* readable() noexcept REALTIME {
    const std::size_t read = read_.load(std::memory_order_relaxed);
    if (written_.load(std::memory_order_acquire) == read) return nullptr;
    return &ring_[read % ring_.size()];
  }
  void release() noexcept REALTIME {
    read_.store(read_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  // Keyframes published and not released; the other side may be changing it.
  std::size_t size() const noexcept REALTIME {
    const std::size_t read = read_.load(std::memory_order_acquire);
    return written_.load(std::memory_order_acquire) - read;
  }

 private:
  std::vector<Keyframe> ring_;
  alignas(64) std::atomic<std::size_t> written_{0};  // stored by the writer alone
  alignas(64) std::atomic<std::size_t> read_{0};     // stored by the reader alone
};

}  // namespace clamor
