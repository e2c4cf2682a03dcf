#include "runtime/voices/narrowband_voices.h"

#include <algorithm>
#include <cassert>
#include <functional>

#include "runtime/voices/gain_ramp_kernel.h"

namespace clamor {

namespace {
constexpr float kStays = 2;  // factor on the power of a narrowband voice: 3 dB of hysteresis
constexpr std::size_t kLanes = kHrtfLanes;
}  // namespace

// Twice as many places as voices: some fade out while others fade in.
NarrowbandVoices::NarrowbandVoices(std::size_t slots, std::size_t max_chosen)
    : max_chosen_(std::min(slots, max_chosen)),
      place_of_(slots, kNone),
      chosen_(slots),
      fine_(2 * max_chosen_),
      targets_(fine_.size() * kLanes),
      gains_(2 * targets_.size()),
      paths_(kEars * fine_.size()),
      gaps_(fine_.size()),
      wraps_(fine_.size()) {
  loudest_.reserve(max_chosen_ + 1);
  free_.reserve(fine_.size());
  audible_.reserve(fine_.size());
  for (std::size_t place = fine_.size(); place-- > 0;)
    free_.push_back(static_cast<std::uint32_t>(place));
}

// Frees the places of voices that have faded out or have left the keyframe.
void NarrowbandVoices::begin() noexcept REALTIME {
  for (std::uint32_t place = 0; place < fine_.size(); ++place) {
    Fine& fine = fine_[place];
    if (fine.slot == kNone || fine.stays) continue;
    place_of_[fine.slot] = kNone;
    fine = {};
    free_.push_back(place);
  }
  for (const auto& [power, slot] : loudest_) chosen_[slot] = false;
  loudest_.clear();
  audible_.clear();
}

void NarrowbandVoices::offer(std::uint32_t slot, float power) noexcept REALTIME {
  if (place_of_[slot] != kNone) power *= kStays;
  if (!(power > 0) || max_chosen_ == 0) return;
  const auto louder = std::greater<std::pair<float, std::uint32_t>>();
  if (loudest_.size() == max_chosen_) {
    if (power <= loudest_.front().first) return;
    std::pop_heap(loudest_.begin(), loudest_.end(), louder);
    loudest_.pop_back();
  }
  loudest_.emplace_back(power, slot);
  std::push_heap(loudest_.begin(), loudest_.end(), louder);
}

void NarrowbandVoices::end() noexcept REALTIME {
  for (const auto& [power, slot] : loudest_) chosen_[slot] = true;
  for (Fine& fine : fine_) fine.stays = false;
}

bool NarrowbandVoices::set(std::uint32_t slot, const float* targets, bool starts,
                           int frames) noexcept REALTIME {
  std::uint32_t place = place_of_[slot];
  if (place == kNone) {
    if (targets == nullptr) return false;
    assert(!free_.empty());
    place = place_of_[slot] = free_.back();
    free_.pop_back();
    fine_[place].slot = slot;
    starts = true;
  }
  static constexpr std::array<float, kLanes> kSilence{};
  const bool audible =
      ramp_gains({&targets_[place * kLanes], &gains_[2 * place * kLanes],
                  targets == nullptr ? kSilence.data() : targets, kLanes, frames, starts});
  fine_[place].stays = targets != nullptr;
  if (audible) audible_.push_back(place);
  return audible;
}

void NarrowbandVoices::hold() noexcept REALTIME {
  for (const std::uint32_t place : audible_) {
    std::copy_n(&targets_[place * kLanes], kLanes, &gains_[2 * place * kLanes]);
    std::fill_n(&gains_[(2 * place + 1) * kLanes], kLanes, 0.0f);
  }
}

void NarrowbandVoices::mix(const MixMode& mode, const MixContinuation& slots, int first_frame,
                           int frames, float* high, float* low) noexcept REALTIME {
  if (audible_.empty()) return;
  for (const std::uint32_t place : audible_) {
    const std::uint32_t slot = fine_[place].slot;
    std::copy_n(slots.paths + std::size_t{kEars} * slot, kEars, &paths_[kEars * place]);
    gaps_[place] = slots.gaps[slot];
    wraps_[place] = slots.wraps[slot];
  }
  mix_voices(mode, {paths_.data(),
                    gains_.data(),
                    audible_.data(),
                    audible_.size(),
                    first_frame,
                    frames,
                    high,
                    low,
                    gaps_.data(),
                    {paths_.data(), gaps_.data(), wraps_.data()}});
}

void NarrowbandVoices::put_back(const MixContinuation& slots) const noexcept REALTIME {
  for (const std::uint32_t place : audible_) {
    const std::uint32_t slot = fine_[place].slot;
    std::copy_n(&paths_[kEars * place], kEars, slots.paths + std::size_t{kEars} * slot);
    slots.gaps[slot] = gaps_[place];
  }
}

}  // namespace clamor
