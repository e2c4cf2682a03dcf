// replaceable_signals.h: slots for signals that an application brings while an auralizer plays.
//
// A slot holds a signal that plays once or is live, or a loop with a signal for its onset
// (onset_signals.h). Voices name them after the signals that the auralizer was made with: slot i is
// the signals 2 i and 2 i + 1. A slot that was cleared is free once the mixer has loaded a keyframe
// after the last one that named it, about a quarter of a second later.
//
// Threads: the sampler's; the audio thread reads playable() by keyframes that name the slots.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/mixing/onset_signals.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/streaming/playable_signals.h"
#include "runtime/voices/keyframe.h"

namespace clamor {

// A signal for a slot, prepared for the auralizer's mode.
struct SlotSignal {
  std::shared_ptr<const PreparedSignal> signal;
  std::shared_ptr<const PreparedSignal> onset{};  // of a loop; null for others
  LoudnessTrack weights;
};

class ReplaceableSignals {
 public:
  // `first` is the number of the auralizer's other signals.
  ReplaceableSignals(std::size_t slots, std::uint32_t first, const MixMode& mode);

  std::size_t slots() const { return owned_.size(); }
  PlayableSignals::Slots playable() const { return table_; }
  std::shared_ptr<std::vector<LoudnessTrack>> weights() const { return weights_; }

  std::uint32_t signal_of(std::size_t slot) const {
    return first_ + 2 * static_cast<std::uint32_t>(slot);
  }
  // The signal that plays the beginning of a slot's.
  std::uint32_t onset_of(std::size_t slot) const;

  // The slot must be free.
  void set(std::size_t slot, SlotSignal signal);
  // No source may play the slot from the next keyframe on.
  void clear(std::size_t slot);
  bool is_free(std::size_t slot) const { return owned_[slot].signal == nullptr; }

  // Replaces the weights of a live signal.
  void set_weights(std::size_t slot, const LoudnessTrack& weights);

  // The keyframe names this signal, besides what its voices name.
  void name(std::uint32_t signal, const Keyframe& keyframe) {
    if (signal >= first_) owned_[(signal - first_) / 2].last_named = keyframe.number;
  }
  // Call with each keyframe that is made, and with the number of keyframes that the mixer has
  // loaded. Frees slots.
  void made(const Keyframe& keyframe, std::uint64_t loaded);

 private:
  struct Owned {
    std::shared_ptr<const PreparedSignal> signal, onset;
    std::uint64_t last_named = 0;  // keyframe
    bool is_cleared = false;
  };

  const std::uint32_t first_;
  const std::shared_ptr<const PreparedSignal> silence_;
  std::vector<Owned> owned_;
  std::vector<const PreparedSignal*> table_;
  std::shared_ptr<std::vector<LoudnessTrack>> weights_;
  std::size_t cleared_ = 0;  // slots that are to become free
};

}  // namespace clamor
