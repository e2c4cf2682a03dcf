#include "runtime/engine/replaceable_signals.h"

#include <cassert>
#include <utility>

namespace clamor {

namespace {

const LoudnessTrack& silent_track() {
  static const LoudnessTrack kSilent(Bands{}, Bands{});
  return kSilent;
}

}  // namespace

ReplaceableSignals::ReplaceableSignals(std::size_t slots, std::uint32_t first, const MixMode& mode)
    : first_(first),
      silence_(std::make_shared<const PreparedSignal>(Signal{}, mode)),
      owned_(slots),
      table_(2 * slots, silence_.get()),
      weights_(slots == 0
                   ? nullptr
                   : std::make_shared<std::vector<LoudnessTrack>>(2 * slots, silent_track())) {}

std::uint32_t ReplaceableSignals::onset_of(std::size_t slot) const {
  const bool has_onset = owned_[slot].onset != nullptr;
  return has_onset ? signal_of(slot) + 1 : signal_of(slot);
}

void ReplaceableSignals::set(std::size_t slot, SlotSignal signal) {
  assert(is_free(slot));
  Owned& owned = owned_[slot];
  owned = {std::move(signal.signal), std::move(signal.onset)};
  table_[2 * slot] = owned.signal.get();
  if (owned.onset != nullptr) table_[2 * slot + 1] = owned.onset.get();
  set_weights(slot, signal.weights);
}

void ReplaceableSignals::set_weights(std::size_t slot, const LoudnessTrack& weights) {
  (*weights_)[2 * slot] = (*weights_)[2 * slot + 1] = weights;
}

void ReplaceableSignals::clear(std::size_t slot) {
  assert(!is_free(slot) && !owned_[slot].is_cleared);
  owned_[slot].is_cleared = true;
  ++cleared_;
}

void ReplaceableSignals::made(const Keyframe& keyframe, std::uint64_t loaded) {
  if (owned_.empty()) return;
  for (const Voice& voice : keyframe.voices) name(voice.signal, keyframe);
  if (cleared_ == 0) return;
  for (std::size_t slot = 0; slot < owned_.size(); ++slot) {
    Owned& owned = owned_[slot];
    // The keyframe after the last one that named it has been loaded too.
    if (!owned.is_cleared || loaded < owned.last_named + 2) continue;
    owned = {};
    table_[2 * slot] = table_[2 * slot + 1] = silence_.get();
    set_weights(slot, silent_track());
    --cleared_;
  }
}

}  // namespace clamor
