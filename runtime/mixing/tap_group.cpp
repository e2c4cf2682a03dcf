#include "runtime/mixing/tap_group.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace clamor {

std::uint32_t TapGroup::take_slot() {
  if (!free_.empty()) {
    const std::uint32_t slot = free_.back();
    free_.pop_back();
    return slot;
  }
  if (used_ == slots_.size()) {
    slots_.resize(std::max<std::size_t>(VoiceTable::kTile, 2 * slots_.size()));
    gains_.resize(slots_.size());
    table_.resize(slots_.size());
  }
  return static_cast<std::uint32_t>(used_++);
}

void TapGroup::update(std::uint32_t s, const SampledSource& chosen, bool is_new) {
  slots_[s].is_chosen = true;
  const auto scale = static_cast<float>(chosen.power_scale);
  const Bands gain = power_gain(chosen.factors);
  bool has_changed =
      is_new || table_.radiation.scale[s] != scale || table_.radiation.power_gain[s] != gain;
  if (is_new || chosen.moves) {
    const double frames_before = table_.geometry.emission_frames[s];
    const Vec3f place_before_m = table_.position_of(s);
    const Bands power_before = table_.radiation.power[s];
    table_.put(s, *chosen.source, chosen.start_s);
    table_.set_velocity(s, chosen.velocity_mps);
    const double moved_m = std::abs(table_.geometry.emission_frames[s] - frames_before) /
                               table_.geometry.frames_per_m +
                           static_cast<double>(length(table_.position_of(s) - place_before_m));
    // An emitter that is a tap rests, and its way around edges may jump.
    if (!is_new && !chosen.source->is_emitter) moved_m_ = std::max(moved_m_, moved_m);
    has_changed = has_changed || moved_m > 0 || table_.radiation.power[s] != power_before;
  }
  if (!has_changed) return;
  has_changed_ = slots_[s].has_new_gains = true;
  ++new_gains_;
  table_.radiation.scale[s] = scale;
  table_.radiation.power_gain[s] = gain;
}

void TapGroup::take(std::span<const SampledSource* const> chosen) {
  updated_.clear();
  moved_m_ = 0;
  std::size_t h = 0;
  const auto pass = [&](std::size_t end) {  // taps that are no longer chosen fade out
    for (; h < end; ++h) {
      slots_[by_number_[h].slot].is_chosen = false;
      has_changed_ = true;
      updated_.push_back(by_number_[h]);
    }
  };
  for (const SampledSource* const one : chosen) {
    std::size_t end = h;
    while (end < by_number_.size() && by_number_[end].number < one->number) ++end;
    pass(end);
    const bool is_new = h == by_number_.size() || by_number_[h].number != one->number;
    const std::uint32_t slot = is_new ? take_slot() : by_number_[h++].slot;
    if (is_new) slots_[slot] = {.in_use = true};
    update(slot, *one, is_new);
    updated_.push_back({one->number, slot});
  }
  pass(by_number_.size());
  std::swap(by_number_, updated_);
}

bool TapGroup::advance(float step) {
  if (!std::exchange(has_changed_, false)) return false;
  std::erase_if(by_number_, [&](const Entry& one) {
    Slot& slot = slots_[one.slot];
    const float to = slot.is_chosen ? 1 : 0;
    slot.presence = std::clamp(slot.presence + (slot.is_chosen ? step : -step), 0.0f, 1.0f);
    has_changed_ = has_changed_ || slot.presence != to;
    if (slot.presence > 0 || slot.is_chosen) return false;
    slot = {};
    free_.push_back(one.slot);
    return true;
  });
  return true;
}

}  // namespace clamor
