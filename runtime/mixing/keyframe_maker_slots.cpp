// keyframe_maker_slots.cpp: how KeyframeMaker assigns slots to chosen sources and moves them.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "runtime/mixing/keyframe_maker.h"

namespace clamor {

namespace {

constexpr std::size_t kSlotsAhead = 16;  // prefetch distance for lookups by number

}  // namespace

KeyframeMaker::SlotDirectory::SlotDirectory(std::size_t slots) {
  by_number.reserve(2 * slots);
  updated.reserve(2 * slots);
  for (std::size_t s = slots; s-- > 0;) free.push_back(static_cast<std::uint32_t>(s));
}

std::uint32_t KeyframeMaker::SlotDirectory::take() {
  const std::uint32_t slot = free.back();
  free.pop_back();
  used = std::max<std::size_t>(used, slot + 1);
  ++in_use;
  return slot;
}

void KeyframeMaker::SlotDirectory::give_back(std::uint32_t slot) {
  --in_use;
  free.push_back(slot);
}

// Chosen sources that have a slot keep it; others take free slots. Both lists are sorted by number.
void KeyframeMaker::assign_slots(std::span<const SampledSource> sample) {
  directory_.updated.clear();
  std::size_t h = 0;
  const auto is_used = [this](const SlotDirectory::Entry& one) {
    const Slot& slot = slots_[one.slot];
    return slot.in_use && !slot.frozen && slot.number == one.number;
  };
  // Voices that are not chosen may still fade out.
  const auto pass_slots_before = [&](std::uint64_t number) {
    for (; h < directory_.by_number.size() && directory_.by_number[h].number < number; ++h)
      if (is_used(directory_.by_number[h])) directory_.updated.push_back(directory_.by_number[h]);
  };
  for (const SampledSource& chosen : sample) {
    assert(&chosen == sample.data() || (&chosen)[-1].number < chosen.number);
    pass_slots_before(chosen.number);
    if (h + kSlotsAhead < directory_.by_number.size())
      __builtin_prefetch(&slots_[directory_.by_number[h + kSlotsAhead].slot]);
    const bool known =
        h < directory_.by_number.size() && directory_.by_number[h].number == chosen.number;
    const std::uint32_t slot = known ? directory_.by_number[h].slot : 0;
    const bool is_active = known && is_used(directory_.by_number[h]);
    h += known;
    if (is_active && keep(slot, chosen))
      directory_.updated.push_back({chosen.number, slot});
    else if (!directory_.free.empty())
      directory_.updated.push_back({chosen.number, start(chosen)});
  }
  for (; h < directory_.by_number.size(); ++h)
    if (is_used(directory_.by_number[h])) directory_.updated.push_back(directory_.by_number[h]);
  std::swap(directory_.by_number, directory_.updated);
}

// Returns false if the source has moved too far for its delays to follow; it then fades out where
// it was.
bool KeyframeMaker::keep(std::uint32_t s, const SampledSource& chosen) {
  Slot& slot = slots_[s];
  slot.moves = slot.moves || chosen.moves;
  if (slot.moves && !follow(s, chosen)) return false;
  slot.last_chosen = keyframe_count_;
  slot.scale.set_target(static_cast<float>(chosen.power_scale));
  slot.rank = static_cast<float>(chosen.rank);
  // Without smoothing the current gain is the target.
  const Bands gain = power_gain(chosen.factors);
  if ((slot.smooths ? power_gain_targets_[s] : table_.radiation.power_gain[s]) != gain) {
    power_gain_targets_[s] = gain;
    slot.smooths = true;
  }
  return true;
}

bool KeyframeMaker::follow(std::uint32_t s, const SampledSource& chosen) {
  Slot& slot = slots_[s];
  const Source& source = *chosen.source;
  if (!slides_to(s, point_of(chosen), table_.emission_frames_of(source, chosen.start_s))) {
    slot.frozen = true;
    return false;
  }
  const double power_before = sum_of(table_.radiation.power[s]);
  table_.put(s, source, chosen.start_s);
  table_.set_velocity(s, chosen.velocity_mps);
  if (!source.is_emitter) slot.scale.change_power(power_before / sum_of(source.power));
  slot.changed = true;
  return true;
}

// Extrapolates a moving source while it fades out, unless that takes it too far.
void KeyframeMaker::extrapolate(std::uint32_t s) {
  MovingSourcePoint point{table_.position_of(s), table_.mach_of(s), 0};
  point.age_m = length(listener_.last.centre_m - Vec3(point.position_m)) +
                kKeyframeFrames / table_.geometry.frames_per_m;
  const Vec3f moved_m(point.later_m(listener_.now.centre_m) * Vec3(point.mach));
  table_.move(s, moved_m);
  slots_[s].changed = true;
  point.position_m += moved_m;
  point.age_m = length(listener_.now.centre_m - Vec3(point.position_m));
  if (!slides_to(s, point, table_.geometry.emission_frames[s])) slots_[s].frozen = true;
}

std::uint32_t KeyframeMaker::start(const SampledSource& chosen) {
  const std::uint32_t s = directory_.take();
  const Source& source = *chosen.source;
  table_.put(s, source, chosen.start_s);
  table_.set_velocity(s, chosen.velocity_mps);
  table_.radiation.scale[s] = static_cast<float>(chosen.power_scale);
  table_.radiation.power_gain[s] = power_gain_targets_[s] = power_gain(chosen.factors);
  slots_[s] = {.number = chosen.number,
               .last_chosen = keyframe_count_,
               .scale = {.target = static_cast<float>(chosen.power_scale)},
               .rank = static_cast<float>(chosen.rank),
               .in_use = true,
               .starts = true,
               .moves = chosen.moves};
  slots_[s].scale.previous_targets.fill(slots_[s].scale.target);
  slots_[s].changed = true;
  Voice& voice = voices_[s];
  voice.signal = chosen.signal;
  // The delays start from the extrapolated position of the last keyframe, unless the listener
  // jumped.
  const double emission_frames = table_.geometry.emission_frames[s];
  const MovingSourcePoint point = point_of(chosen);
  MovingSourcePoint last_point = point;
  last_point.age_m -= kKeyframeFrames / table_.geometry.frames_per_m;
  for (int e = 0; e < kEars; ++e) {
    const double now =
        delay_frames(table_, listener_.now, itd_table_.get(), point, emission_frames, e);
    const double last =
        delay_frames(table_, listener_.last, itd_table_.get(), last_point, emission_frames, e);
    voice.start_delay_frames[e] = std::abs(now - last) <= kMaxSlide_frames ? last : now;
  }
  begin_sound(s, chosen);
  return s;
}

// A source whose first sample arrives after the previous keyframe needs no fade-in. A loop emitted
// at time 0 or earlier has always been playing.
void KeyframeMaker::begin_sound(std::uint32_t s, const SampledSource& chosen) {
  Voice& voice = voices_[s];
  voice.has_onset = false;
  const std::uint32_t onset = chosen.signal < onsets_.size() ? onsets_[chosen.signal] : kNoOnset;
  const bool loops = onset != chosen.signal;
  const bool has_always_played =
      loops && (!chosen.moves || table_.geometry.emission_frames[s] <= 0);
  if (onset == kNoOnset || has_always_played) return;
  const double before_frames = due_frames_ - kKeyframeFrames;
  // The rounding error: a baked source's delay is a float, a moving source's start a double.
  const double rounds_frames = chosen.moves ? 1e-3 : 1e-7 * table_.geometry.emission_frames[s];
  for (const double delay_frames : voice.start_delay_frames)
    if (before_frames > delay_frames + rounds_frames) return;
  voice.has_onset = true;
  voice.signal = onset;
  slots_[s].fade = static_cast<std::int8_t>(fade_.keyframes);
  if (loops) slots_[s].loop = chosen.signal;
}

// Switches to the loop once the onset has played far enough at both ears.
void KeyframeMaker::switch_to_loop(std::uint32_t s) {
  Slot& slot = slots_[s];
  if (slot.loop == kNoOnset) return;
  for (const double delay_frames : voices_[s].delay_frames)
    if (due_frames_ - delay_frames < kOnsetChange_frames) return;
  voices_[s].signal = std::exchange(slot.loop, kNoOnset);
}

MovingSourcePoint KeyframeMaker::point_of(const SampledSource& chosen) const {
  const Vec3f& position_m = chosen.source->position_m;
  const double speed_of_sound_mps = kSampleRate_hz / table_.geometry.frames_per_m;
  return {position_m, chosen.velocity_mps / static_cast<float>(speed_of_sound_mps),
          length(listener_.now.centre_m - Vec3(position_m))};
}

bool KeyframeMaker::slides_to(std::uint32_t s, const MovingSourcePoint& point,
                              double emission_frames) const {
  for (int e = 0; e < kEars; ++e) {
    const double frames =
        delay_frames(table_, listener_.now, itd_table_.get(), point, emission_frames, e);
    if (std::abs(frames - voices_[s].delay_frames[e]) > listener_.max_slide_frames) return false;
  }
  return true;
}

}  // namespace clamor
