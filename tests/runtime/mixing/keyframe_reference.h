// keyframe_reference.h: a plain version of KeyframeMaker that makes one voice after another, for
// comparison.
//
// Nothing here is fast: gains and delays come straight from the radiation model and the HRTF,
// sources are looked up in a map, and all arithmetic is in double precision.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <memory>
#include <numbers>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/listener.h"
#include "common/sample_rate.h"
#include "runtime/mixing/keyframe_maker.h"

namespace clamor::testing {

class KeyframeReference {
 public:
  using Receivers = KeyframeMaker::Receivers;

  KeyframeReference(const RadiationModel& radiation, std::size_t slots,
                    Receivers receivers = Receivers::kPair,
                    std::shared_ptr<const Hrtf> head = nullptr);

  void make(std::span<const SampledSource> sample, const Listener& pose, Keyframe& keyframe);

 private:
  struct ListenerFrame {
    Vec3 centre_m;
    std::array<Vec3, kEars> ear_positions_m;
    Vec3 ahead, left, up;
    bool operator==(const ListenerFrame&) const = default;
  };

  struct Slot {
    std::uint64_t number = 0;
    Source source;  // a copy, because its page may be evicted during the fade-out
    int fade = 0;   // in 0..kFadeKeyframes; 0 is silence
    bool in_use = false;
    bool chosen = false;   // in the present sample
    bool frozen = false;   // its path jumped: it fades out with its last values
    bool changed = false;  // since listen(), even if the ears have not moved
    double power_scale = 1, power_scale_goal = 1;
    std::deque<double> power_scale_goals;  // of the last keyframes, newest first
    double rank = -1;
    bool moves = false;
    Vec3f velocity_mps{};
    Bands power_gain = same_in_all_bands(1), power_gain_goal = same_in_all_bands(1);
    Voice voice;  // as in the last keyframe, before the fade
  };

  ListenerFrame head_at(const Listener& pose) const;
  // Velocity as a fraction of the speed of sound.
  Vec3 mach_of(const Vec3f& velocity_mps) const {
    return Vec3(velocity_mps / static_cast<float>(radiation_.speed_of_sound_mps()));
  }
  static double later_m(const Source& source, const Vec3& mach, double age_m, const Vec3& place);
  double delay_frames(const Source& source, const Vec3f& velocity_mps, double age_m,
                      const ListenerFrame& head, int ear) const;
  // Delay of a source that was at its place when the sound that now reaches the centre of the head
  // left it.
  double delay_frames(const Source& source, const Vec3f& velocity_mps, const ListenerFrame& head,
                      int ear) const {
    return delay_frames(source, velocity_mps, length(head.centre_m - Vec3(source.position_m)), head,
                        ear);
  }
  void listen(Slot& slot, const ListenerFrame& head) const;
  static void approach_power_gain(Slot& slot);
  static void approach_power_scale(Slot& slot);
  static std::uint8_t rank_of(const Slot& slot);
  void start(const SampledSource& chosen, const ListenerFrame& head);
  static Vec3f direction_from(const Source& source, const ListenerFrame& head);
  bool jumped(const Slot& slot, const ListenerFrame& head) const;
  bool follow(Slot& slot, const SampledSource& chosen, const ListenerFrame& head);
  void coast(Slot& slot, const ListenerFrame& head);
  void freeze(Slot& slot);

  const RadiationModel& radiation_;
  const Receivers receivers_;
  const std::shared_ptr<const Hrtf> ears_;
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_;                                  // slots, lowest last
  std::unordered_map<std::uint64_t, std::uint32_t> slot_of_number_;  // of sources with a voice
  ListenerFrame last_head_{};
  Vec3 last_step_m_{0, 0, 0};
  double fastest_slide_frames_ = 0;  // in this keyframe
  std::uint64_t keyframe_count_ = 0;
};

// Upper bound of a change of delay per keyframe: a delay cannot shrink as fast as time passes.
inline constexpr double kFastestSlide_frames = 0.98 * kKeyframeFrames;

// A larger change of the listener's step than this is a jump, as after a stall of the sampler:
// nobody gains 35 m/s from one keyframe to the next. Sliding delays would be heard as a chirp.
inline constexpr double kLeap_m = 0.7;
inline constexpr double kSlideAfterLeap_frames = 0.1 * kKeyframeFrames;

inline double fade_gain(int fade) {
  return fade == kFadeKeyframes ? 1 : std::sin(std::numbers::pi / 2 * fade / kFadeKeyframes);
}

inline KeyframeReference::KeyframeReference(const RadiationModel& radiation, std::size_t slots,
                                            Receivers receivers, std::shared_ptr<const Hrtf> head)
    : radiation_(radiation), receivers_(receivers), ears_(std::move(head)), slots_(slots) {
  slot_of_number_.reserve(slots);
  for (std::size_t s = slots; s-- > 0;) {
    slots_[s].voice.slot = static_cast<std::uint32_t>(s);
    free_.push_back(static_cast<std::uint32_t>(s));
  }
}

inline KeyframeReference::ListenerFrame KeyframeReference::head_at(const Listener& pose) const {
  const double half_m = receivers_ == Receivers::kPair ? 0.5 * kEarDistance_m : 0;
  const Vec3 side_m = half_m * pose.right();
  return {pose.position_m,
          {pose.position_m - side_m, pose.position_m + side_m},
          pose.forward(),
          -pose.right(),
          pose.up()};
}

// Solves by bisection: sound that left the source later arrives too late.
inline double KeyframeReference::later_m(const Source& source, const Vec3& mach, double age_m,
                                         const Vec3& place) {
  double low = -1e6, high = std::max(age_m, 0.0) + 1e6;
  for (int i = 0; i < 200; ++i) {
    const double later = (low + high) / 2;
    const double distance_m = length(place - Vec3(source.position_m) - later * mach);
    (age_m - later > distance_m ? low : high) = later;
  }
  return low;
}

inline double KeyframeReference::delay_frames(const Source& source, const Vec3f& velocity_mps,
                                              double age_m, const ListenerFrame& head,
                                              int ear) const {
  Source there = source;
  double frames = radiation_.delay_s(source, head.ear_positions_m[ear]) * kSampleRate_hz;
  if (velocity_mps != Vec3f(0)) {
    const Vec3 mach = mach_of(velocity_mps);
    const double later = later_m(source, mach, age_m, head.ear_positions_m[ear]);
    there.position_m = Vec3f(Vec3(source.position_m) + later * mach);
    frames = radiation_.delay_s(source, length(head.ear_positions_m[ear] - Vec3(source.position_m) -
                                               later * mach)) *
             kSampleRate_hz;
  }
  return ears_ == nullptr ? frames : frames + ears_->delay_frames(direction_from(there, head), ear);
}

inline void KeyframeReference::listen(Slot& slot, const ListenerFrame& head) const {
  slot.changed = false;
  slot.voice.from = direction_from(slot.source, head);
  const int places = receivers_ == Receivers::kPair ? kEars : 1;
  for (int e = 0; e < places; ++e) {
    Source there = slot.source;
    const Vec3 mach = mach_of(slot.velocity_mps);
    const double age_m = length(head.centre_m - Vec3(there.position_m));
    if (slot.moves)
      there.position_m += Vec3f(
          later_m(there, mach, age_m, head.ear_positions_m[static_cast<std::size_t>(e)]) * mach);
    const Bands intensity =
        radiation_.intensity(there, head.ear_positions_m[static_cast<std::size_t>(e)]);
    slot.voice.delay_frames[e] = delay_frames(slot.source, slot.velocity_mps, head, e);
    // The square root converts the power of the bake to the amplitude of the mixer.
    for (std::size_t b = 0; b < kBandCount; ++b)
      slot.voice.gain[e][b] =
          std::sqrt(static_cast<float>(slot.power_scale * static_cast<double>(intensity[b])) *
                    slot.power_gain[b]) *
          static_cast<float>(slot.source.polarity);
  }
  if (places == kEars) return;
  slot.voice.delay_frames[1] = delay_frames(slot.source, slot.velocity_mps, head, 1);
  slot.voice.gain[1] = slot.voice.gain[0];
}

// Direction in the listener's axes; ahead for a source within the head.
inline Vec3f KeyframeReference::direction_from(const Source& source, const ListenerFrame& head) {
  const Vec3 to_m = Vec3(source.position_m) - head.centre_m;
  const double distance_m = length(to_m);
  if (!(distance_m > 1e-6)) return {1, 0, 0};
  return Vec3f(Vec3(dot(to_m, head.ahead), dot(to_m, head.left), dot(to_m, head.up)) / distance_m);
}

inline void KeyframeReference::approach_power_gain(Slot& slot) {
  constexpr float kNear = 1e-3f;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    if (slot.power_gain[b] == slot.power_gain_goal[b]) continue;
    const float rest = slot.power_gain_goal[b] - slot.power_gain[b];
    slot.power_gain[b] =
        std::abs(rest) < kNear ? slot.power_gain_goal[b] : slot.power_gain[b] + rest / 2;
    slot.changed = true;
  }
}

inline void KeyframeReference::approach_power_scale(Slot& slot) {
  slot.power_scale_goals.push_front(slot.power_scale_goal);
  slot.power_scale_goals.pop_back();
  double scale = 0;
  for (int f = 0; f < kFadeKeyframes; ++f)
    scale += (std::pow(fade_gain(f + 1), 2) - std::pow(fade_gain(f), 2)) *
             slot.power_scale_goals[static_cast<std::size_t>(f)];
  slot.changed = slot.changed || scale != slot.power_scale;
  slot.power_scale = scale;
}

// Voices that fade out are the first to be shed. Without an order from the sampler, ranks are half
// decibels.
inline std::uint8_t KeyframeReference::rank_of(const Slot& slot) {
  if (!slot.chosen || slot.frozen) return kHighestRank;
  if (slot.rank >= 0) return static_cast<std::uint8_t>(std::lround(slot.rank * (kHighestRank - 1)));
  double power = 0;
  for (const Bands& ear : slot.voice.gain)
    for (const float band : ear) power += static_cast<double>(band) * band;
  const double level_db = 10 * std::log10(std::max(power, 1e-30));
  return static_cast<std::uint8_t>(
      std::lround(std::clamp(2 * (20 - level_db), 0.0, static_cast<double>(kHighestRank - 1))));
}

inline bool KeyframeReference::jumped(const Slot& slot, const ListenerFrame& head) const {
  for (int e = 0; e < kEars; ++e) {
    const double frames = delay_frames(slot.source, slot.velocity_mps, head, e);
    if (std::abs(frames - slot.voice.delay_frames[e]) > fastest_slide_frames_) return true;
  }
  return false;
}

inline void KeyframeReference::start(const SampledSource& chosen, const ListenerFrame& head) {
  if (free_.empty()) return;
  Slot& slot = slots_[free_.back()];
  slot_of_number_[chosen.number] = free_.back();
  free_.pop_back();
  slot.number = chosen.number;
  slot.source = *chosen.source;
  slot.fade = 0;
  slot.in_use = slot.chosen = true;
  slot.frozen = false;
  slot.changed = true;
  slot.power_scale = slot.power_scale_goal = chosen.power_scale;
  slot.power_scale_goals.assign(kFadeKeyframes, chosen.power_scale);
  slot.rank = chosen.rank;
  slot.power_gain = slot.power_gain_goal = power_gain(chosen.factors);
  slot.voice.starts = true;
  slot.voice.signal = chosen.signal;
  slot.moves = chosen.moves;
  slot.velocity_mps = chosen.velocity_mps;
  // The delay slides from its value at the last keyframe, unless the listener jumped.
  const double age_m = length(head.centre_m - Vec3(slot.source.position_m)) -
                       kKeyframe_s * radiation_.speed_of_sound_mps();
  for (int e = 0; e < kEars; ++e) {
    const double now_frames = delay_frames(slot.source, slot.velocity_mps, head, e);
    const double last_frames = delay_frames(slot.source, slot.velocity_mps, age_m, last_head_, e);
    const bool slides = std::abs(now_frames - last_frames) <= kFastestSlide_frames;
    slot.voice.start_delay_frames[e] = slides ? last_frames : now_frames;
  }
}

// A moving source that fades out continues on its path, unless it gets too far.
inline void KeyframeReference::coast(Slot& slot, const ListenerFrame& head) {
  const Vec3 mach = mach_of(slot.velocity_mps);
  const double age_m = length(last_head_.centre_m - Vec3(slot.source.position_m)) +
                       kKeyframe_s * radiation_.speed_of_sound_mps();
  slot.source.position_m += Vec3f(later_m(slot.source, mach, age_m, head.centre_m) * mach);
  slot.changed = true;
  if (jumped(slot, head)) freeze(slot);
}

inline void KeyframeReference::freeze(Slot& slot) {
  slot.frozen = true;
  slot_of_number_.erase(slot.number);
}

// Returns false if the source jumped too far for a sliding delay; it then fades out at its old
// place.
inline bool KeyframeReference::follow(Slot& slot, const SampledSource& chosen,
                                      const ListenerFrame& head) {
  if (!chosen.moves) return true;
  const Source before = std::exchange(slot.source, *chosen.source);
  slot.changed = true;
  const Vec3f velocity_mps = std::exchange(slot.velocity_mps, chosen.velocity_mps);
  if (!jumped(slot, head)) return true;
  slot.source = before;
  slot.velocity_mps = velocity_mps;
  freeze(slot);
  return false;
}

inline void KeyframeReference::make(std::span<const SampledSource> sample, const Listener& pose,
                                    Keyframe& keyframe) {
  const ListenerFrame head = head_at(pose);
  if (keyframe_count_ == 0) last_head_ = head;
  const bool still = head == last_head_;
  const Vec3 step_m = head.centre_m - last_head_.centre_m;
  const bool leapt = length(step_m - last_step_m_) > kLeap_m;
  fastest_slide_frames_ = leapt ? kSlideAfterLeap_frames : kFastestSlide_frames;
  last_step_m_ = step_m;

  for (Slot& slot : slots_) {
    slot.chosen = false;
    slot.voice.starts = false;
    if (!slot.in_use || slot.frozen || still || slot.moves || !jumped(slot, head)) continue;
    freeze(slot);
  }
  for (const SampledSource& chosen : sample) {
    const auto heard = slot_of_number_.find(chosen.number);
    if (heard == slot_of_number_.end() || !follow(slots_[heard->second], chosen, head)) {
      start(chosen, head);
    } else {
      Slot& slot = slots_[heard->second];
      slot.chosen = true;
      slot.power_scale_goal = chosen.power_scale;
      slot.rank = chosen.rank;
      slot.power_gain_goal = power_gain(chosen.factors);
    }
  }

  keyframe.number = keyframe_count_;
  keyframe.voices.clear();
  for (Slot& slot : slots_) {
    if (!slot.in_use) continue;
    if (keyframe_count_ == 0)
      slot.fade = kFadeKeyframes;
    else
      slot.fade = std::clamp(slot.fade + (slot.chosen ? 1 : -1), 0, kFadeKeyframes);
    if (slot.moves && !slot.chosen && !slot.frozen) coast(slot, head);
    if (!slot.frozen) approach_power_gain(slot);
    if (!slot.frozen) approach_power_scale(slot);
    if (!slot.frozen && (!still || slot.changed)) listen(slot, head);

    Voice& voice = keyframe.voices.emplace_back(slot.voice);
    voice.rank = rank_of(slot);
    const auto gain = static_cast<float>(fade_gain(slot.fade));
    for (Bands& ear : voice.gain)
      for (float& band : ear) band *= gain;

    if (slot.fade > 0) continue;
    slot.in_use = false;
    if (!slot.frozen) slot_of_number_.erase(slot.number);
    free_.push_back(slot.voice.slot);
  }
  last_head_ = head;
  ++keyframe_count_;
}

}  // namespace clamor::testing
