#include "runtime/mixing/keyframe_maker.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/maths.h"
#include "runtime/realtime/prefetch.h"

namespace clamor {

namespace {

// A listener whose speed changes by more than 35 m/s between keyframes was moved abruptly, for
// example after the sampler had stalled. Delays that followed the jump would be heard as a chirp.
constexpr double kLeap_m = 0.7;
constexpr double kMaxSlideAfterLeap_frames = 0.1 * kKeyframeFrames;

constexpr double kMaxPowerRatio = 1e6;  // from one keyframe to the next, of a source's power

constexpr float kLastRank = kHighestRank - 1;  // of chosen voices

float equal_power_gain(int fade) {
  static const auto gains = [] {
    std::array<float, kFadeKeyframes + 1> sines{};
    for (int f = 0; f <= kFadeKeyframes; ++f)
      sines[static_cast<std::size_t>(f)] =
          static_cast<float>(std::sin(std::numbers::pi / 2 * f / kFadeKeyframes));
    sines.back() = 1;
    return sines;
  }();
  return gains[static_cast<std::size_t>(fade)];
}

// The share of its power that a source gains with each keyframe of a fade-in; they add up to 1.
const std::array<float, kFadeKeyframes>& fade_steps() {
  static const auto steps = [] {
    std::array<float, kFadeKeyframes> powers{};
    for (int f = 0; f < kFadeKeyframes; ++f)
      powers[static_cast<std::size_t>(f)] = equal_power_gain(f + 1) * equal_power_gain(f + 1) -
                                            equal_power_gain(f) * equal_power_gain(f);
    return powers;
  }();
  return steps;
}

}  // namespace

KeyframeMaker::KeyframeMaker(const RadiationModel& radiation, std::size_t slots,
                             Receivers receivers, std::shared_ptr<const Hrtf> head,
                             OnsetSignals onsets, Fade fade)
    : receivers_(receivers),
      fade_(fade),
      itd_table_(head == nullptr ? nullptr : std::make_unique<const ItdTable>(*head)),
      onsets_(std::move(onsets)),
      table_(radiation, slots),
      directory_(slots),
      slots_(slots),
      voices_(slots),
      power_gain_targets_(slots) {
  for (std::size_t s = 0; s < slots; ++s) voices_[s].slot = static_cast<std::uint32_t>(s);
}

float KeyframeMaker::fade_gain(int keyframes) const {
  return fade_.is_linear ? static_cast<float>(keyframes) / static_cast<float>(fade_.keyframes)
                         : equal_power_gain(keyframes);
}

// Applies the directivity of the receivers to these voices.
void KeyframeMaker::apply_directivity(std::span<const std::uint32_t> slots) {
  for (const std::uint32_t s : slots)
    for (int e = 0; e < kEars; ++e) {
      const Vec3 ear_m = listener_.now.ear_positions_m[static_cast<std::size_t>(e)];
      const Bands gain = reception_.gain(e, Vec3f(Vec3(table_.position_of(s)) - ear_m));
      for (std::size_t b = 0; b < kBandCount; ++b) voices_[s].gain[e][b] *= gain[b];
    }
}

// Recomputes the position of all voices for a new listener. Voices whose delays jumped fade out
// where they were.
void KeyframeMaker::place_all() {
  constexpr std::size_t kTile = VoiceTable::kTile;
  VoiceArrivals& arrivals = table_.arrivals;
  std::swap(arrivals.delay_frames, arrivals.last_delay_frames);
  place_voices(table_, listener_.now, itd_table_.get(), 0,
               (directory_.used + kTile - 1) / kTile * kTile);
  std::fill(table_.geometry.changed.begin(), table_.geometry.changed.end(), false);
  const auto jumped = [&arrivals, max_frames = listener_.max_slide_frames](std::size_t ear,
                                                                           std::size_t s) {
    return std::abs(arrivals.delay_frames[ear][s] - arrivals.last_delay_frames[ear][s]) >
           max_frames;
  };
  for (std::size_t first = 0; first < directory_.used; first += kTile) {
    std::int64_t any = 0;  // a sum, so that the loop is vectorised
    for (std::size_t e = 0; e < kEars; ++e)
      for (std::size_t s = first; s < first + kTile; ++s) any += jumped(e, s) ? 1 : 0;
    if (any == 0) continue;
    for (std::size_t s = first; s < std::min(first + kTile, directory_.used); ++s)
      if (slots_[s].in_use && !slots_[s].moves && (jumped(0, s) || jumped(1, s)))
        slots_[s].frozen = true;
  }
}

// Moves half of the way to the target.
void KeyframeMaker::smooth_power_gain(std::uint32_t s) {
  constexpr float kNear = 1e-3f;
  Bands& gain = table_.radiation.power_gain[s];
  const Bands& target = power_gain_targets_[s];
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const float change = target[b] - gain[b];
    gain[b] = std::abs(change) < kNear ? target[b] : gain[b] + change / 2;
  }
  slots_[s].smooths = gain != target;
  slots_[s].changed = true;
}

// Sources that fade in, fade out, and change their scale have constant total power.
float KeyframeMaker::PowerScale::next() {
  const std::array<float, kFadeKeyframes>& steps = fade_steps();
  float scale = steps[0] * target;
  for (std::size_t f = 1; f < steps.size(); ++f) scale += steps[f] * previous_targets[f - 1];
  std::shift_right(previous_targets.begin(), previous_targets.end(), 1);
  previous_targets[0] = target;
  return --keyframes_left == 0 ? target : scale;
}

void KeyframeMaker::PowerScale::change_power(double ratio) {
  if (ratio == 1 || !(ratio <= kMaxPowerRatio)) return;
  for (float& previous : previous_targets) previous *= static_cast<float>(ratio);
  keyframes_left = kFadeKeyframes;
}

void KeyframeMaker::update_scale(std::uint32_t s) {
  Slot& slot = slots_[s];
  if (slot.scale.keyframes_left == 0) return;
  table_.radiation.scale[s] = slot.scale.next();
  slot.changed = true;
}

// A listener who leaps was moved abruptly, and delays do not follow.
void KeyframeMaker::ListenerStep::set_step(const Vec3& next_step_m) {
  const bool leapt = length(next_step_m - step_m) > kLeap_m;
  max_slide_frames = leapt ? kMaxSlideAfterLeap_frames : kMaxSlide_frames;
  step_m = next_step_m;
}

// For samplers that give no ranks: the level, in steps of half a decibel.
std::uint8_t KeyframeMaker::rank_by_level(const Voice& voice) {
  Bands power;
  for (std::size_t b = 0; b < kBandCount; ++b)
    power[b] = voice.gain[0][b] * voice.gain[0][b] + voice.gain[1][b] * voice.gain[1][b];
  static_assert(kBandCount == 8, "a power of two, for sums in pairs");
  for (std::size_t half = kBandCount / 2; half > 0; half /= 2)
    for (std::size_t b = 0; b < half; ++b) power[b] += power[b + half];
  const float level_db = 10 * std::numbers::ln2_v<float> / std::numbers::ln10_v<float> *
                         log2_of(std::max(power[0], 1e-30f));
  return static_cast<std::uint8_t>(std::clamp(2 * (20 - level_db), 0.0f, kLastRank) + 0.5f);
}

// Voices that fade out anyway are shed first.
std::uint8_t KeyframeMaker::rank_of(const Slot& slot, const Voice& voice) const {
  if (!is_chosen(slot) || slot.frozen) return kHighestRank;
  return slot.rank < 0 ? voice.rank : static_cast<std::uint8_t>(slot.rank * kLastRank + 0.5f);
}

void KeyframeMaker::make(std::span<const SampledSource> sample, const Listener& listener,
                         Keyframe& keyframe, const Reception& reception,
                         std::uint64_t held_frames) {
  due_frames_ = static_cast<double>(keyframe_count_ * kKeyframeFrames + held_frames);
  reception_ = reception;
  const ListenerFrame frame = listener_frame(listener, receivers_);
  const bool still = keyframe_count_ > 0 && frame == listener_.now;
  listener_.last = keyframe_count_ > 0 ? listener_.now : frame;
  listener_.now = frame;
  listener_.set_step(kKeyframe_s * listener.velocity_mps);

  if (!still) place_all();
  assign_slots(sample);

  keyframe.number = keyframe_count_;
  assert(directory_.in_use <= keyframe.voices.capacity());
  keyframe.voices.resize(directory_.in_use);
  std::size_t count = 0;
  for (std::size_t first = 0; first < directory_.used; first += VoiceTable::kTile)
    count = make_tile(first, still, keyframe, count);
  assert(count == keyframe.voices.size());
  ++keyframe_count_;
}

// Appends the voices of a tile of slots to the keyframe, which has `count` voices so far. Returns
// the new count.
std::size_t KeyframeMaker::make_tile(std::size_t first, bool still, Keyframe& keyframe,
                                     std::size_t count) {
  const std::size_t last = std::min(first + VoiceTable::kTile, directory_.used);
  // Prefetch what the next tile writes: stores to uncached memory would stall all others.
  for (std::size_t s = last; s < std::min(last + VoiceTable::kTile, directory_.used); ++s) {
    prefetch_to_write(&voices_[s], sizeof(Voice));
    if (count + s - first < keyframe.voices.size())
      prefetch_to_write(&keyframe.voices[count + s - first], sizeof(Voice));
  }
  std::array<std::uint32_t, VoiceTable::kTile> made;
  std::size_t makes = 0;
  for (auto s = static_cast<std::uint32_t>(first); s < last; ++s) {
    Slot& slot = slots_[s];
    if (!slot.in_use) continue;
    if (keyframe_count_ == 0)
      slot.fade = static_cast<std::int8_t>(fade_.keyframes);
    else
      slot.fade = static_cast<std::int8_t>(
          std::clamp(slot.fade + (is_chosen(slot) ? 1 : -1), 0, fade_.keyframes));
    if (slot.moves && !is_chosen(slot) && !slot.frozen) extrapolate(s);
    if (slot.frozen) continue;
    if (slot.smooths) smooth_power_gain(s);
    update_scale(s);
    if (!still || slot.changed) made[makes++] = s;
    slot.changed = false;
  }
  if (table_.geometry.changed[first / VoiceTable::kTile]) {
    place_voices(table_, listener_.now, itd_table_.get(), first, first + VoiceTable::kTile);
    table_.geometry.changed[first / VoiceTable::kTile] = false;
  }
  if (makes > 0) {
    make_voices(table_, listener_.now.places, std::span(made).first(makes), voices_.data());
    if (!reception_.is_omnidirectional()) apply_directivity(std::span(made).first(makes));
  }
  for (const std::uint32_t s : std::span(made).first(makes))
    if (slots_[s].rank < 0) voices_[s].rank = rank_by_level(voices_[s]);
  for (auto s = static_cast<std::uint32_t>(first); s < last; ++s) {
    Slot& slot = slots_[s];
    if (!slot.in_use) continue;
    switch_to_loop(s);
    Voice& voice = keyframe.voices[count++];
    const std::uint8_t rank = rank_of(slot, voices_[s]);
    voice = voices_[s];
    voice.starts = std::exchange(slot.starts, false);
    voice.rank = rank;
    if (slot.fade == fade_.keyframes) continue;
    const float gain = fade_gain(slot.fade);
    for (Bands& ear : voice.gain)
      for (float& band : ear) band *= gain;
    if (slot.fade > 0) continue;
    slot.in_use = false;
    directory_.give_back(s);
  }
  return count;
}

}  // namespace clamor
