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

// A delay cannot shrink as fast as time passes. So much less is a source that comes nearer at half
// the speed of sound (kMaxSourceMach).
constexpr double kFastestSlide_frames = 0.98 * kKeyframeFrames;

// A listener who is elsewhere all at once, as after the sampler stood still, has leapt: nobody is
// 35 m/s faster from one keyframe to the next. Sliding after them would be heard as a chirp.
constexpr double kLeap_m = 0.7;
constexpr double kSlideAfterLeap_frames = 0.1 * kKeyframeFrames;

constexpr float kLastRank = kHighestRank - 1;  // of those that are chosen

constexpr std::size_t kSlotsAhead = 16;  // for prefetching what is looked up by number

float fade_gain(int fade) {
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

// The shares of its power that a source which fades in gains with each keyframe; they add up to 1.
const std::array<float, kFadeKeyframes>& fade_steps() {
  static const auto steps = [] {
    std::array<float, kFadeKeyframes> powers{};
    for (int f = 0; f < kFadeKeyframes; ++f)
      powers[static_cast<std::size_t>(f)] =
          fade_gain(f + 1) * fade_gain(f + 1) - fade_gain(f) * fade_gain(f);
    return powers;
  }();
  return steps;
}

}  // namespace

KeyframeMaker::KeyframeMaker(const RadiationModel& field, std::size_t slots, Receivers receivers,
                             std::shared_ptr<const Hrtf> head, OnsetSignals onsets)
    : receivers_(receivers),
      lags_(head == nullptr ? nullptr : std::make_unique<const ItdTable>(*head)),
      onsets_(std::move(onsets)),
      table_(field, slots),
      last_frames_(table_.delay_frames),
      slots_(slots),
      voices_(slots),
      visibility_goal_(slots),
      tile_moved_(slots / VoiceTable::kTile + 1) {
  heard_.reserve(2 * slots);
  joined_.reserve(2 * slots);
  for (std::size_t s = slots; s-- > 0;) {
    voices_[s].slot = static_cast<std::uint32_t>(s);
    free_.push_back(static_cast<std::uint32_t>(s));
  }
}

ListenerFrame KeyframeMaker::head_at(const Listener& listener) const {
  const bool pair = receivers_ == Receivers::kPair;
  const Vec3 side_m = (pair ? 0.5 * kEarDistance_m : 0) * listener.right();
  return {listener.position_m, {listener.position_m - side_m, listener.position_m + side_m},
          listener.forward(),  -listener.right(),
          listener.up(),       pair ? kEars : 1};
}

// What each receiver hears of those voices from where it is.
void KeyframeMaker::receive(std::span<const std::uint32_t> slots) {
  for (const std::uint32_t s : slots)
    for (int e = 0; e < kEars; ++e) {
      const Vec3 ear_m = head_.ear_positions_m[static_cast<std::size_t>(e)];
      const Bands gain = reception_.gain(e, Vec3f(Vec3(table_.position_of(s)) - ear_m));
      for (std::size_t b = 0; b < kBandCount; ++b) voices_[s].gain[e][b] *= gain[b];
    }
}

// Places all that is heard anew; what jumped by that fades out where it was.
void KeyframeMaker::turn_to(const ListenerFrame& head) {
  constexpr std::size_t kTile = VoiceTable::kTile;
  head_ = head;
  std::swap(table_.delay_frames, last_frames_);
  place_voices(table_, head_, lags_.get(), 0, (used_ + kTile - 1) / kTile * kTile);
  std::fill(tile_moved_.begin(), tile_moved_.end(), false);
  const auto jumped = [this](std::size_t ear, std::size_t s) {
    return std::abs(table_.delay_frames[ear][s] - last_frames_[ear][s]) > fastest_slide_frames_;
  };
  for (std::size_t first = 0; first < used_; first += kTile) {
    std::int64_t any = 0;  // a sum, so that the loop becomes vector code
    for (std::size_t e = 0; e < kEars; ++e)
      for (std::size_t s = first; s < first + kTile; ++s) any += jumped(e, s) ? 1 : 0;
    if (any == 0) continue;
    for (std::size_t s = first; s < std::min(first + kTile, used_); ++s)
      if (slots_[s].in_use && !slots_[s].moves && (jumped(0, s) || jumped(1, s)))
        slots_[s].frozen = true;
  }
}

MovingSourcePoint KeyframeMaker::point_of(const SampledSource& chosen) const {
  const Vec3f& position_m = chosen.source->position_m;
  const double speed_of_sound_mps = kSampleRate_hz / table_.frames_per_m;
  return {position_m, chosen.velocity_mps / static_cast<float>(speed_of_sound_mps),
          length(head_.centre_m - Vec3(position_m))};
}

bool KeyframeMaker::slides_to(std::uint32_t s, const MovingSourcePoint& point,
                              double emission_frames) const {
  for (int e = 0; e < kEars; ++e) {
    const double frames = delay_frames(table_, head_, lags_.get(), point, emission_frames, e);
    if (std::abs(frames - voices_[s].delay_frames[e]) > fastest_slide_frames_) return false;
  }
  return true;
}

// Those that are chosen and heard stay in their slots, others take free ones. Both lists ascend.
void KeyframeMaker::join(std::span<const SampledSource> sample) {
  joined_.clear();
  std::size_t h = 0;
  const auto is_heard = [this](const Heard& heard) {
    const Slot& slot = slots_[heard.slot];
    return slot.in_use && !slot.frozen && slot.number == heard.number;
  };
  const auto pass_to = [&](std::uint64_t number) {  // what is not chosen may still fade out
    for (; h < heard_.size() && heard_[h].number < number; ++h)
      if (is_heard(heard_[h])) joined_.push_back(heard_[h]);
  };
  for (const SampledSource& chosen : sample) {
    assert(&chosen == sample.data() || (&chosen)[-1].number < chosen.number);
    pass_to(chosen.number);
    if (h + kSlotsAhead < heard_.size()) __builtin_prefetch(&slots_[heard_[h + kSlotsAhead].slot]);
    const bool known = h < heard_.size() && heard_[h].number == chosen.number;
    const std::uint32_t slot = known ? heard_[h].slot : 0;
    const bool heard = known && is_heard(heard_[h]);
    h += known;
    if (heard && keep(slot, chosen))
      joined_.push_back({chosen.number, slot});
    else if (!free_.empty())
      joined_.push_back({chosen.number, start(chosen)});
  }
  for (; h < heard_.size(); ++h)
    if (is_heard(heard_[h])) joined_.push_back(heard_[h]);
  std::swap(heard_, joined_);
}

// False if it is now too far away for sliding there: then it fades out where it was.
bool KeyframeMaker::keep(std::uint32_t s, const SampledSource& chosen) {
  Slot& slot = slots_[s];
  if (chosen.moves && !follow(s, chosen)) return false;
  slot.chosen = made_;
  slot.weigh_as(static_cast<float>(chosen.power_scale));
  slot.rank = static_cast<float>(chosen.rank);
  // One that does not glide is where it is meant to be.
  if ((slot.glides ? visibility_goal_[s] : table_.visibility[s]) != chosen.visibility) {
    visibility_goal_[s] = chosen.visibility;
    slot.glides = true;
  }
  return true;
}

bool KeyframeMaker::follow(std::uint32_t s, const SampledSource& chosen) {
  Slot& slot = slots_[s];
  const Source& source = *chosen.source;
  if (!slides_to(s, point_of(chosen), table_.emission_frames_of(source))) {
    slot.frozen = true;
    return false;
  }
  table_.put(s, source);
  table_.set_velocity(s, chosen.velocity_mps);
  change(s);
  return true;
}

// One that fades out goes on, unless that took it too far.
void KeyframeMaker::coast(std::uint32_t s) {
  MovingSourcePoint point{table_.position_of(s), table_.mach_of(s), 0};
  point.age_m =
      length(last_head_.centre_m - Vec3(point.position_m)) + kKeyframeFrames / table_.frames_per_m;
  const Vec3f moved_m(point.later_m(head_.centre_m) * Vec3(point.mach));
  table_.move(s, moved_m);
  change(s);
  point.position_m += moved_m;
  point.age_m = length(head_.centre_m - Vec3(point.position_m));
  if (!slides_to(s, point, table_.emission_frames[s])) slots_[s].frozen = true;
}

void KeyframeMaker::change(std::uint32_t s) {
  slots_[s].changed = true;
  tile_moved_[s / VoiceTable::kTile] = true;
}

std::uint32_t KeyframeMaker::start(const SampledSource& chosen) {
  const std::uint32_t s = free_.back();
  free_.pop_back();
  used_ = std::max<std::size_t>(used_, s + 1);
  const Source& source = *chosen.source;
  table_.put(s, source);
  table_.set_velocity(s, chosen.velocity_mps);
  table_.scale[s] = static_cast<float>(chosen.power_scale);
  table_.visibility[s] = visibility_goal_[s] = chosen.visibility;
  slots_[s] = {.number = chosen.number,
               .chosen = made_,
               .scale_goal = static_cast<float>(chosen.power_scale),
               .rank = static_cast<float>(chosen.rank),
               .in_use = true,
               .starts = true,
               .moves = chosen.moves};
  slots_[s].scale_goals_before.fill(slots_[s].scale_goal);
  change(s);
  ++in_use_;
  Voice& voice = voices_[s];
  voice.signal = chosen.signal;
  // It slides in from where it would have been, unless the listener jumped.
  const double emission_frames = table_.emission_frames[s];
  const MovingSourcePoint point = point_of(chosen);
  MovingSourcePoint last_point = point;
  last_point.age_m -= kKeyframeFrames / table_.frames_per_m;
  for (int e = 0; e < kEars; ++e) {
    const double now = delay_frames(table_, head_, lags_.get(), point, emission_frames, e);
    const double last =
        delay_frames(table_, last_head_, lags_.get(), last_point, emission_frames, e);
    voice.start_delay_frames[e] = std::abs(now - last) <= kFastestSlide_frames ? last : now;
  }
  begin_sound(s, chosen);
  return s;
}

// Does the signal's first sample arrive only after the keyframe before? Then there is nothing to
// fade in. A loop that leaves at time 0 or earlier has always been playing.
void KeyframeMaker::begin_sound(std::uint32_t s, const SampledSource& chosen) {
  Voice& voice = voices_[s];
  voice.has_onset = false;
  const std::uint32_t onset = chosen.signal < onsets_.size() ? onsets_[chosen.signal] : kNoOnset;
  const bool loops = onset != chosen.signal;
  const bool has_always_played = loops && (!chosen.moves || table_.emission_frames[s] <= 0);
  if (onset == kNoOnset || has_always_played) return;
  const double before_frames = now_frames_ - kKeyframeFrames;
  const double rounds_frames = 1e-7 * table_.emission_frames[s];  // a source's delay is a float
  for (const double delay_frames : voice.start_delay_frames)
    if (before_frames > delay_frames + rounds_frames) return;
  voice.has_onset = true;
  voice.signal = onset;
  slots_[s].fade = kFadeKeyframes;
  if (loops) slots_[s].loop = chosen.signal;
}

// Changes over to the loop once the onset has played so far at both ears.
void KeyframeMaker::leave_onset(std::uint32_t s) {
  Slot& slot = slots_[s];
  if (slot.loop == kNoOnset) return;
  for (const double delay_frames : voices_[s].delay_frames)
    if (now_frames_ - delay_frames < kOnsetChange_frames) return;
  voices_[s].signal = std::exchange(slot.loop, kNoOnset);
}

// Half the way to what is visible of it.
void KeyframeMaker::glide(std::uint32_t s) {
  constexpr float kNear = 1e-3f;
  Bands& visibility = table_.visibility[s];
  const Bands& goal = visibility_goal_[s];
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const float way = goal[b] - visibility[b];
    visibility[b] = std::abs(way) < kNear ? goal[b] : visibility[b] + way / 2;
  }
  slots_[s].glides = visibility != goal;
  slots_[s].changed = true;
}

// The change of each keyframe takes the course of a fade. Sources that fade in and out, and those
// that stay and stand for fewer or more, then have the same power together all the way.
void KeyframeMaker::weigh(std::uint32_t s) {
  Slot& slot = slots_[s];
  if (slot.keyframes_to_weigh == 0) return;
  const std::array<float, kFadeKeyframes>& steps = fade_steps();
  float scale = steps[0] * slot.scale_goal;
  for (std::size_t f = 1; f < steps.size(); ++f) scale += steps[f] * slot.scale_goals_before[f - 1];
  std::shift_right(slot.scale_goals_before.begin(), slot.scale_goals_before.end(), 1);
  slot.scale_goals_before[0] = slot.scale_goal;
  if (--slot.keyframes_to_weigh == 0) scale = slot.scale_goal;
  table_.scale[s] = scale;
  slot.changed = true;
}

// Where the sampler has no order: in half decibels.
std::uint8_t KeyframeMaker::rank_by_level(const Voice& voice) {
  Bands power;
  for (std::size_t b = 0; b < kBandCount; ++b)
    power[b] = voice.gain[0][b] * voice.gain[0][b] + voice.gain[1][b] * voice.gain[1][b];
  for (std::size_t half = kBandCount / 2; half > 0; half /= 2)
    for (std::size_t b = 0; b < half; ++b) power[b] += power[b + half];
  const float level_db = 10 * std::numbers::ln2_v<float> / std::numbers::ln10_v<float> *
                         log2_of(std::max(power[0], 1e-30f));
  return static_cast<std::uint8_t>(std::clamp(2 * (20 - level_db), 0.0f, kLastRank) + 0.5f);
}

// Those that fade out anyway go first.
std::uint8_t KeyframeMaker::rank_of(const Slot& slot, const Voice& voice) const {
  if (!is_chosen(slot) || slot.frozen) return kHighestRank;
  return slot.rank < 0 ? voice.rank : static_cast<std::uint8_t>(slot.rank * kLastRank + 0.5f);
}

void KeyframeMaker::make(std::span<const SampledSource> sample, const Listener& listener,
                         Keyframe& keyframe, const Reception& reception,
                         std::uint64_t held_frames) {
  now_frames_ = static_cast<double>(made_ * kKeyframeFrames + held_frames);
  const ListenerFrame head = head_at(listener);
  reception_ = reception;
  if (made_ == 0) last_head_ = head;
  const bool still = made_ > 0 && head == last_head_;
  const Vec3 step_m = kKeyframe_s * listener.velocity_mps;
  const bool leapt = length(step_m - last_step_m_) > kLeap_m;
  fastest_slide_frames_ = leapt ? kSlideAfterLeap_frames : kFastestSlide_frames;
  last_step_m_ = step_m;

  if (!still) turn_to(head);
  join(sample);

  keyframe.number = made_;
  assert(in_use_ <= keyframe.voices.capacity());
  keyframe.voices.resize(in_use_);
  std::size_t count = 0;
  for (std::size_t first = 0; first < used_; first += VoiceTable::kTile)
    count = make_tile(first, still, keyframe, count);
  assert(count == keyframe.voices.size());
  last_head_ = head;
  ++made_;
}

// Adds the voices of a tile of slots from the keyframe's voice `count` on; returns how many it has
// then.
std::size_t KeyframeMaker::make_tile(std::size_t first, bool still, Keyframe& keyframe,
                                     std::size_t count) {
  const std::size_t last = std::min(first + VoiceTable::kTile, used_);
  // What is written next, ahead of time: stores to memory that is far away hold up all others.
  for (std::size_t s = last; s < std::min(last + VoiceTable::kTile, used_); ++s) {
    prefetch_to_write(&voices_[s], sizeof(Voice));
    if (count + s - first < keyframe.voices.size())
      prefetch_to_write(&keyframe.voices[count + s - first], sizeof(Voice));
  }
  std::array<std::uint32_t, VoiceTable::kTile> made;
  std::size_t makes = 0;
  for (auto s = static_cast<std::uint32_t>(first); s < last; ++s) {
    Slot& slot = slots_[s];
    if (!slot.in_use) continue;
    if (made_ == 0)
      slot.fade = kFadeKeyframes;
    else
      slot.fade = static_cast<std::int8_t>(
          std::clamp(slot.fade + (is_chosen(slot) ? 1 : -1), 0, kFadeKeyframes));
    if (slot.moves && !is_chosen(slot) && !slot.frozen) coast(s);
    if (slot.frozen) continue;
    if (slot.glides) glide(s);
    weigh(s);
    if (!still || slot.changed) made[makes++] = s;
    slot.changed = false;
  }
  if (tile_moved_[first / VoiceTable::kTile]) {
    place_voices(table_, head_, lags_.get(), first, first + VoiceTable::kTile);
    tile_moved_[first / VoiceTable::kTile] = false;
  }
  if (makes > 0) {
    make_voices(table_, head_.places, std::span(made).first(makes), voices_.data());
    if (!reception_.is_omnidirectional()) receive(std::span(made).first(makes));
  }
  for (const std::uint32_t s : std::span(made).first(makes))
    if (slots_[s].rank < 0) voices_[s].rank = rank_by_level(voices_[s]);
  for (auto s = static_cast<std::uint32_t>(first); s < last; ++s) {
    Slot& slot = slots_[s];
    if (!slot.in_use) continue;
    leave_onset(s);
    Voice& voice = keyframe.voices[count++];
    const std::uint8_t rank = rank_of(slot, voices_[s]);
    voice = voices_[s];
    voice.starts = std::exchange(slot.starts, false);
    voice.rank = rank;
    if (slot.fade == kFadeKeyframes) continue;
    const float gain = fade_gain(slot.fade);
    for (Bands& ear : voice.gain)
      for (float& band : ear) band *= gain;
    if (slot.fade > 0) continue;
    slot.in_use = false;
    --in_use_;
    free_.push_back(s);
  }
  return count;
}

}  // namespace clamor
