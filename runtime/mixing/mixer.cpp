#include "runtime/mixing/mixer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <type_traits>

#include "runtime/realtime/flush_denormals.h"

namespace clamor {

namespace {

constexpr std::size_t kVoicesAhead = 6;

static_assert(kKeyframeFrames % kStepFrames == 0 && kBankTailFrames % kStepFrames == 0);

// What is heard depends on so many frames before. The filters of a head end; those of octaves and
// responses fade out.
constexpr int kHeadTail_frames = 2048;
static_assert(kHeadTail_frames % kStepFrames == 0 && kBankTailFrames % kHeadTail_frames == 0 &&
              kHeadTail_frames > 2 * (kHrtfDelayFrames + kBankDelayFrames));
int tail_frames(const MixMode& mode) {
  if (mode.head && !mode.field) return kHeadTail_frames;
  return mode.two_layers() ? kBankTailFrames : 0;
}

MixMode without_head(MixMode mode) {
  if (mode.head) mode.eight_bands = true;
  mode.head = false;
  return mode;
}

}  // namespace

Mixer::Mixer(PlayableSignals signals, std::size_t slots, const MixMode& mode, const Panner* panner,
             const Hrtf* head, const HeadRotation* turns)
    : signals_(signals),
      mode_(mode),
      layout_{without_head(mode), without_head(mode).gain_lanes(),
              BusGains::of(mode.head ? HrtfFilters::bus_gains() : OctaveFilterBank::bus_gains())},
      panner_(panner),
      lead_frames_(mode.head          ? kHrtfDelayFrames
                   : mode.eight_bands ? kBankDelayFrames
                                      : 0),
      binaural_(mode.head ? std::make_unique<Binaural>(
                                *head, slots, static_cast<std::size_t>(mode.narrowband_voices))
                          : nullptr),
      field_(mode.field ? std::make_unique<FieldMixer>(signals, mode.pairs) : nullptr),
      slots_(slots),
      paths_(slots * kEars),
      wraps_(slots),
      pairs_(static_cast<std::size_t>(mode.pairs)),
      tracker_(turns, slots) {
  assert(panner == nullptr ? mode.pairs == 1 : panner->channels() == channels());
  assert(mode.pairs == 1 || mode.delays == 1);
  assert(mode.head == (head != nullptr));
  for (Pair& pair : pairs_) {
    pair.targets.resize(slots * static_cast<std::size_t>(layout_.lanes));
    pair.gains.resize(2 * pair.targets.size());
    if (mode.pairs > 1 || mode.head) pair.active.reserve(slots);
  }
  active_.reserve(slots);
  once_.reserve(slots);
}

void Mixer::begin(const Keyframe& keyframe, std::int64_t clock_frames) {
  time_.clock_frames = clock_frames - tail_frames(mode_);
  time_.frame = kKeyframeFrames;
  clear_active();
  if (binaural_ != nullptr) {
    choose_narrowband(keyframe);
    binaural_->diffuse_eq.begin();
  }
  if (field_ != nullptr) {  // its blocks are on the grid of keyframes
    constexpr int kBefore_frames = kBankTailFrames % kKeyframeFrames;
    field_->begin(keyframe.field, time_.clock_frames + lead_frames_,
                  kKeyframeFrames - kBefore_frames);
    if (binaural_ != nullptr) field_->add_powers(binaural_->diffuse_eq);
  }
  for (const Voice& voice : keyframe.voices) {
    Voice started = voice;
    started.starts = true;
    started.start_delay_frames = started.delay_frames;
    load_voice(started);
    activate(voice.slot);
  }
  if (binaural_ != nullptr) binaural_->bank.slide_octaves(binaural_->diffuse_eq.levels(), 0);
  time_.holding = false;
  std::vector<float> unheard(static_cast<std::size_t>(channels() * kStepFrames));
  while (time_.clock_frames < clock_frames) {
    hold();
    step(unheard.data());
  }
  time_.frame = kKeyframeFrames;
}

void Mixer::load(const Keyframe& keyframe) noexcept REALTIME {
  if (time_.holding) end_hold();
  shedding_.load(keyframe.voices);
  if (field_ != nullptr) field_->load(keyframe.field);
  if (binaural_ != nullptr) choose_narrowband(keyframe);
  if (tracker_.is_on()) tracker_.keep(keyframe);
  load_segment(keyframe.voices, 0, has_turned() ? kKeyframeFrames / 3 : kKeyframeFrames);
}

// Starts a segment in which voices move to their state `frames` frames later in the period.
void Mixer::load_segment(std::span<const Voice> voices, int elapsed, int frames) noexcept REALTIME {
  constexpr int kThird_frames = MixerTimeline::kThird_frames;
  time_.begin_segment(frames == kKeyframeFrames ? MixerSegment::whole()
                      : frames == kThird_frames ? MixerSegment::of(kThird_frames, 192)
                                                : MixerSegment::of(2 * kThird_frames, 384),
                      elapsed);
  time_.shed_end = shedding_.shed() > 0 ? std::min(kShedFrames, frames) : 0;
  clear_active();
  work_.loaded_voices += voices.size();
  if (binaural_ != nullptr) {
    binaural_->narrowband.begin_segment();
    binaural_->diffuse_eq.begin();
    if (field_ != nullptr) field_->add_powers(binaural_->diffuse_eq);
  }
  const HeadTracker::Turns turns = tracker_.turns();
  for (std::size_t v = 0; v < voices.size(); ++v) {
    if (v + kVoicesAhead < voices.size()) prefetch(voices[v + kVoicesAhead].slot);
    if (turns.any)
      load_voice(tracker_.interpolated(voices[v], turns, elapsed, elapsed + frames));
    else
      load_voice(voices[v]);
    activate(voices[v].slot);
  }
  if (binaural_ != nullptr) binaural_->bank.slide_octaves(binaural_->diffuse_eq.levels(), frames);
  tracker_.applied(turns);
  time_.holding = false;
}

void Mixer::allow(std::size_t voices) noexcept REALTIME {
  shedding_.allow(voices);
  if (time_.is_at_end()) return;  // the next load() applies the new limit
  const std::uint8_t rank = shedding_.wanted_limit();
  // Near the end of the segment, load() applies the limit.
  const bool has_time =
      time_.frame >= time_.shed_end && time_.frame + kShedFrames <= time_.segment.frames;
  if (rank < shedding_.limit() && has_time) fade_above(rank);
}

// Ramps the gains from their current values to 0.
void Mixer::fade_above(std::uint8_t rank) noexcept REALTIME {
  time_.shed_end = time_.frame + kShedFrames;
  shedding_.limit_to(rank);
  const float here = static_cast<float>(time_.frame) / kGainFrames;
  constexpr float fade = static_cast<float>(kShedFrames) / kGainFrames;
  for (const std::uint32_t s : active_)
    if (slots_[s].rank > rank)
      change_gains(s, [&](float* target, float* gain, std::size_t lanes) noexcept REALTIME {
        for (std::size_t lane = 0; lane < lanes; ++lane) {
          const float slope = -(gain[lane] + here * gain[lanes + lane]) / fade;
          gain[lanes + lane] = slope;
          gain[lane] = -slope * (here + fade);
        }
        std::fill_n(target, lanes, 0.0f);
      });
}

void Mixer::drop_shed() noexcept REALTIME {
  drop_if([this](std::uint32_t s) { return shedding_.sheds(slots_[s].rank); });
}

void Mixer::clear_active() noexcept REALTIME {
  active_.clear();
  once_.clear();
  for (Pair& pair : pairs_) pair.active.clear();
}

void Mixer::activate(std::uint32_t slot) noexcept REALTIME {
  if (!slots_[slot].audible) return;
  active_.push_back(slot);
  const PreparedSignal& signal = *slots_[slot].signal;
  if (!signal.loops()) once_.push_back(slot);
  wraps_[slot] = signal.loops() ? signal.wrap() : std::numeric_limits<std::int64_t>::max();
}

void Mixer::hold() noexcept REALTIME {
  if (time_.shed_end > 0) drop_shed();
  time_.shed_end = 0;
  if (!time_.holding) {
    const std::size_t lanes = static_cast<std::size_t>(layout_.lanes);
    for (const std::uint32_t s : active_) {
      for (Pair& pair : pairs_) {
        std::copy_n(&pair.targets[s * lanes], lanes, &pair.gains[2 * s * lanes]);
        std::fill_n(&pair.gains[(2 * s + 1) * lanes], lanes, 0.0f);
      }
      stay(s);
      if (binaural_ != nullptr)
        set_layer_offset(s, binaural_->offset_ends[s], binaural_->offset_ends[s]);
    }
    if (binaural_ != nullptr) binaural_->narrowband.hold();
    time_.holding = true;
  }
  const bool falling = hold_sounds();
  time_.segment = MixerSegment::whole();
  time_.elapsed = 0;
  time_.frame = kKeyframeFrames - kStepFrames;
  const std::uint8_t rank = shedding_.wanted_limit();
  if (falling || rank >= shedding_.limit()) return;
  time_.frame = kKeyframeFrames - kShedFrames;
  fade_above(rank);
}

// Before the kernel: advances signals that play once, even where there is nothing to read.
void Mixer::advance_once(int frames) noexcept REALTIME {
  for (const std::uint32_t s : once_)
    for (std::size_t e = 0; e < static_cast<std::size_t>(mode_.delays); ++e) {
      VoicePath path = paths_[s * kEars + e];
      path.position = slots_[s].position[e];
      slots_[s].position[e] = path.position_at(frames);
    }
}

// After the kernel, which has advanced all other voices unless it mixes pairs.
void Mixer::advance(int frames) noexcept REALTIME {
  const auto ears = static_cast<std::size_t>(mode_.delays);
  if (mode_.pairs > 1)
    for (const std::uint32_t s : active_) {
      VoicePath& path = paths_[s * kEars];
      path.position = path.position_at(frames);
      path.step = path.step_at(frames);
      path.position -= path.position >= wraps_[s] ? wraps_[s] : 0;
    }
  for (const std::uint32_t s : once_)
    for (std::size_t e = 0; e < ears; ++e)
      slots_[s].signal->place(slots_[s].position[e], paths_[s * kEars + e]);
  if (time_.frame + frames == time_.segment.knot)
    for (const std::uint32_t s : active_)
      for (std::size_t e = 0; e < ears; ++e) {
        paths_[s * kEars + e].step = slots_[s].after_knot[e].step;
        paths_[s * kEars + e].bend = slots_[s].after_knot[e].bend;
      }
}

void Mixer::mix_pair(std::size_t pair, int frames, float* interleaved) noexcept REALTIME {
  Pair& here = pairs_[pair];
  const auto& active = pairs_.size() > 1 ? here.active : active_;
  if (mode_.eight_bands) {
    std::fill(std::begin(buses_.high), std::end(buses_.high), 0.0f);
    std::fill(std::begin(buses_.low), std::end(buses_.low), 0.0f);
  } else {
    std::fill_n(buses_.high, kEars * kMaxFrames, 0.0f);
  }
  work_.voice_frames += active.size() * static_cast<std::size_t>(frames);
  MixJob job{paths_.data(), here.gains.data(), active.data(), active.size(), time_.frame,
             frames,        buses_.high,       buses_.low};
  if (mode_.pairs == 1) job.next = {paths_.data(), nullptr, wraps_.data()};
  mix_voices(mode_, job);
  if (field_ != nullptr) field_->add_to(buses_, pair, frames);
  if (mode_.eight_bands) {
    here.bank.process(buses_, frames, interleaved, channels());
    return;
  }
  const auto interleave = [&](auto stride) noexcept REALTIME {
    for (int f = 0; f < frames; ++f)
      for (int e = 0; e < kEars; ++e) interleaved[f * stride + e] = buses_.high[e * kMaxFrames + f];
  };
  if (pairs_.size() == 1)
    interleave(std::integral_constant<int, kEars>{});  // a constant stride is vectorised
  else
    interleave(channels());
}

void Mixer::mix_binaural(int frames, float* interleaved) noexcept REALTIME {
  HrtfFilterBank& bank = binaural_->bank;
  NarrowbandVoices& narrowband = binaural_->narrowband;
  LayerOffset* const offsets = binaural_->offsets.data();
  bank.clear();
  const MixContinuation next{paths_.data(), offsets, wraps_.data()};
  narrowband.mix(mode_, next, time_.frame, frames, bank.high(), bank.low());
  const Pair& pair = pairs_[0];
  MixBuses& octaves = bank.octaves();
  work_.voice_frames +=
      (narrowband.audible_count() + pair.active.size()) * static_cast<std::size_t>(frames);
  mix_voices(layout_.mode,
             {paths_.data(), pair.gains.data(), pair.active.data(), pair.active.size(), time_.frame,
              frames, octaves.high, octaves.low, offsets, next});
  narrowband.put_back(next);
  if (field_ != nullptr) field_->add_to(octaves, 0, frames);
  bank.process(frames, interleaved);
}

void Mixer::mix(float* interleaved, int steps) noexcept REALTIME {
  assert(steps >= 1 && steps <= steps_left());
  const FlushDenormals no_denormals;
  const int frames = steps * kStepFrames;
  advance_once(frames);
  if (binaural_ != nullptr)
    mix_binaural(frames, interleaved);
  else
    for (std::size_t p = 0; p < pairs_.size(); ++p) mix_pair(p, frames, interleaved + kEars * p);
  advance(frames);
  if (field_ != nullptr) field_->advance(frames);
  time_.advance(frames);
  if (time_.frame == time_.shed_end && time_.frame < time_.segment.frames) drop_shed();
}

}  // namespace clamor
