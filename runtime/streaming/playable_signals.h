// playable_signals.h: the signals that voices name by index: fixed ones, followed by slots whose
// signals are replaced while others play (replaceable_signals.h).
//
// Threads: the audio thread reads. A slot may be written while no keyframe names it.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "runtime/realtime/realtime.h"
#include "runtime/streaming/prepared_signal.h"

namespace clamor {

class PlayableSignals {
 public:
  using Slots = std::span<const PreparedSignal* const>;

  // Both spans must outlive this.
  PlayableSignals(std::span<const PreparedSignal> fixed, Slots slots = {})  // NOLINT: implicit
      : fixed_(fixed), slots_(slots) {}
  PlayableSignals(const std::vector<PreparedSignal>& fixed)  // NOLINT: implicit
      : PlayableSignals(std::span(fixed)) {}

  const PreparedSignal& operator[](std::size_t signal) const noexcept REALTIME {
    return signal < fixed_.size() ? fixed_[signal] : *slots_[signal - fixed_.size()];
  }
  std::size_t size() const noexcept REALTIME { return fixed_.size() + slots_.size(); }

 private:
  std::span<const PreparedSignal> fixed_;
  Slots slots_;
};

}  // namespace clamor
