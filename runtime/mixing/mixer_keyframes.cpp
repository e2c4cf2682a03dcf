// mixer_keyframes.cpp: how the mixer loads a voice of a keyframe: its delays and its gains. A voice
// that is unusable or has been shed ramps to silence.
#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "common/maths.h"
#include "runtime/mixing/mixer.h"
#include "runtime/realtime/prefetch.h"

namespace clamor {

namespace {

constexpr std::int64_t kFixedOne = std::int64_t{1} << 32;
constexpr double kFixedOne_f = static_cast<double>(kFixedOne);
constexpr double kFastestBent = 0.99;  // frames per frame
constexpr std::int64_t kDelayOne = std::int64_t{1} << Mixer::kDelayBits;
constexpr double kDelayOne_f = static_cast<double>(kDelayOne);
constexpr double kMaxDelay_frames = static_cast<double>(std::int64_t{1} << 38);  // 66 days
// 160 dB above full scale: 100 000 voices of samples of 1e6 sum to 1e19, which no float overflows.
constexpr float kLoudest = 1e8f;

bool is_usable(double delay_frames) {
  return std::abs(delay_frames) < kMaxDelay_frames;  // false for NaN
}

bool is_usable(const Voice& voice) {
  if (!(dot(voice.from, voice.from) < 1.01f)) return false;
  const auto bits = std::bit_cast<std::array<std::int32_t, kEars * kBandCount>>(voice.gain);
  constexpr auto kLoudestBits = std::bit_cast<std::int32_t>(kLoudest);
  // Bits of finite floats are ordered like their values, and NaN is beyond them.
  std::int32_t loud = 0;
  for (const std::int32_t b : bits) loud |= kLoudestBits - (b & 0x7fffffff);
  if (loud < 0) return false;
  for (int e = 0; e < kEars; ++e) {
    if (!is_usable(voice.delay_frames[e])) return false;
    if (voice.starts && !is_usable(voice.start_delay_frames[e])) return false;
  }
  return true;
}

std::int64_t fixed(double frames) { return std::llrint(frames * kFixedOne_f); }
std::int64_t fixed_delay(double frames) { return std::llrint(frames * kDelayOne_f); }

// fixed() for values below 2^19: adding a large number leaves exactly these bits.
std::int64_t fixed_slope(double frames) {
  constexpr double kLarge = 3 << 19;
  return std::bit_cast<std::int64_t>(kLarge + frames) - std::bit_cast<std::int64_t>(kLarge);
}

}  // namespace

// The frame read is clock + lead - delay. For a loop, the ears are usually less than one loop
// apart, which saves a division.
template <std::size_t kDelays>
CLAMOR_INLINE void Mixer::place(Slot& slot, VoicePath* paths,
                                const std::array<std::int64_t, kDelays>& delay) noexcept REALTIME {
  const PreparedSignal& signal = *slot.signal;
  std::int64_t first = 0, first_near = 0;
  for (std::size_t e = 0; e < kDelays; ++e) {
    const std::int64_t whole = time_.clock_frames + lead_frames_ + (-delay[e] >> kDelayBits);
    const bool is_close = e > 0 && std::abs(whole - first) < signal.wrap() >> 32;
    const std::int64_t near = is_close ? first_near + (whole - first) : signal.near(whole);
    if (e == 0) {
      first = whole;
      first_near = near;
    }
    slot.position[e] = near * kFixedOne + (-delay[e] & (kDelayOne - 1)) * (kFixedOne / kDelayOne);
    signal.place(slot.position[e], paths[e]);
  }
}

// The low layer's offset changes linearly.
void Mixer::set_layer_offset(std::uint32_t slot, std::int64_t from,
                             std::int64_t to) noexcept REALTIME {
  binaural_->offsets[slot] = {from, (to - from) / time_.segment.frames};
  binaural_->offset_ends[slot] = to;
}

// Two parabolas with slopes a at the beginning, b at the knot and c at the end, over m and n steps.
// A step's slope is that of its middle, so the total change is m (a + b) / 2 + n (b + c) / 2 steps,
// which gives b. Divisions are avoided, as they took half of the time. The function is not inlined,
// because compilers would pack both ears into vectors, which takes longer.
[[gnu::noinline]] void Mixer::slide(DelaySlope& slope, VoicePath& path, Parabola& after_knot,
                                    double change_frames, bool starts) noexcept REALTIME {
  const double mean = change_frames * time_.segment.per_frame;
  double a = mean, b = mean, c = mean;
  if (!starts) {
    a = slope.end;
    c = 1.5 * mean - 0.5 * slope.mean;
    b = 2 * mean - time_.segment.share_m * a - time_.segment.share_n * c;
    if (std::max({std::abs(a), std::abs(b), std::abs(c)}) > kFastestBent) a = b = c = mean;
  }
  slope = {mean, c};
  const auto parabola = [](double from, double to, double per_step) {
    const double bend = (to - from) * per_step;
    return Parabola{kFixedOne - fixed_slope(from + 0.5 * bend), -fixed_slope(bend)};
  };
  const Parabola before_knot = parabola(a, b, time_.segment.per_m);
  path.step = before_knot.step;
  path.bend = before_knot.bend;
  after_knot = parabola(b, c, time_.segment.per_n);
}

// Moves from the current state, or from where the voice starts, to its new delays. A template by
// number of delays, so that values stay in registers. Returns false if the voice is unusable, in
// which case its delays hold, or if its signal is not resident.
template <std::size_t kDelays>
bool Mixer::slide_to(const Voice& voice) noexcept REALTIME {
  Slot& slot = slots_[voice.slot];
  std::array<std::int64_t, kDelays> from, to;
  std::array<double, kDelays> change_frames;
  bool usable = is_usable(voice);
  for (std::size_t e = 0; e < kDelays; ++e) {
    from[e] = slot.delay[e];
    if (usable && voice.starts) from[e] = fixed_delay(voice.start_delay_frames[e]);
    to[e] = usable ? fixed_delay(voice.delay_frames[e]) : from[e];
    change_frames[e] = static_cast<double>(to[e] - from[e]) / kDelayOne_f;
    usable = usable && std::abs(change_frames[e]) < time_.segment.frames;
  }
  if (!usable) {
    ++muted_.bad;
    change_frames = {};
    std::copy_n(slot.delay.begin(), kDelays, from.begin());
    to = from;
  }
  VoicePath* const paths = &paths_[voice.slot * std::size_t{kEars}];
  for (std::size_t e = 0; e < kDelays; ++e) {
    slide(slot.slopes[e], paths[e], slot.after_knot[e], change_frames[e], voice.starts || !usable);
    slot.delay[e] = to[e];
  }
  place(slot, paths, from);
  if (!slot.signal->streams()) return usable;
  std::array<std::int64_t, kEars> first{};
  std::array<double, kEars> change{};
  std::ranges::copy(from, first.begin());
  std::ranges::copy(change_frames, change.begin());
  return may_sound(voice.slot, first, change) && usable;
}

void Mixer::stay(std::uint32_t s) noexcept REALTIME {
  Slot& slot = slots_[s];
  VoicePath* const paths = &paths_[s * std::size_t{kEars}];
  for (std::size_t e = 0; e < static_cast<std::size_t>(mode_.delays); ++e)
    slide(slot.slopes[e], paths[e], slot.after_knot[e], 0, true);
  if (mode_.delays == 1)
    place(slot, paths, std::array{slot.delay[0]});
  else
    place(slot, paths, slot.delay);
}

void Mixer::set_targets(const std::array<Bands, kEars>& gain,
                        float* targets) const noexcept REALTIME {
  if (layout_.mode.eight_bands) return bus_lanes(layout_.gains, gain, targets);
  for (std::size_t e = 0; e < kEars; ++e) targets[e] = gain[e][0];
}

float Mixer::power_of(const Voice& voice) const noexcept REALTIME {
  const Bands& mean_square = signals_[voice.signal].mean_square();
  float sum = 0;
  for (const Bands& ear : voice.gain)
    for (std::size_t b = 0; b < kBandCount; ++b) sum += mean_square[b] * ear[b] * ear[b];
  return sum;
}

void Mixer::choose_narrowband(const Keyframe& keyframe) noexcept REALTIME {
  NarrowbandVoices& narrowband = binaural_->narrowband;
  narrowband.begin();
  for (const Voice& voice : keyframe.voices)
    if (!shedding_.sheds(voice.rank)) narrowband.offer(voice.slot, power_of(voice));
  narrowband.end();
}

// Octave gains times the HRTF's gains, in narrow bands or in octaves. Returns true if anything is
// audible.
bool Mixer::set_hrtf_gains(const Voice& voice, bool usable,
                           const DirectionMesh::Place& place) noexcept REALTIME {
  const bool fine = usable && binaural_->narrowband.chosen(voice.slot);
  std::array<float, kHrtfLanes> colours;
  if (fine) {
    const auto levels = binaural_->hrtf.gains(place);
    const auto across = binaural_->hrtf.quadrature_gains(place);
    for (std::size_t e = 0; e < kEars; ++e) {
      const HrtfGains own = HrtfFilters::levels_of(voice.gain[e]);
      for (std::size_t j = 0; j < kHrtfBands; ++j) colours[kEars * j + e] = own[j] * levels[e][j];
      const QuadratureGains at = HrtfFilters::at_quadratures(own);
      for (std::size_t k = 0; k < kHrtfQuadratures; ++k)
        colours[kEars * (kHrtfBands + k) + e] = at[k] * across[e][k];
    }
  }
  const bool in_bands = binaural_->narrowband.set(voice.slot, fine ? colours.data() : nullptr,
                                                  voice.starts, slide_frames(voice));
  constexpr std::array<float, kBandLanes> kSilence{};
  const GainRamps octaves = gain_ramps(0, voice, kSilence.data());
  const bool in_octaves =
      usable && !fine ? ramp_hrtf_gains(layout_.gains, binaural_->diffuse_eq.corners(place),
                                        voice.gain, signals_[voice.signal].mean_square(), octaves)
                      : ramp_gains(octaves);
  if (in_octaves) pairs_[0].active.push_back(voice.slot);
  return in_bands || in_octaves;
}

// The state of a voice is scattered over memory.
void Mixer::prefetch(std::uint32_t slot) const noexcept REALTIME {
  const std::size_t lanes = static_cast<std::size_t>(layout_.lanes);
  prefetch_to_write(&slots_[slot], sizeof(Slot));
  prefetch_to_write(&paths_[slot * std::size_t{kEars}], kEars * sizeof(VoicePath));
  if (binaural_ != nullptr) prefetch_to_write(&binaural_->offsets[slot], sizeof(LayerOffset));
  for (const Pair& pair : pairs_) {
    prefetch_to_write(&pair.targets[slot * lanes], lanes * sizeof(float));
    prefetch_to_write(&pair.gains[2 * slot * lanes], 2 * lanes * sizeof(float));
  }
}

void Mixer::load_voice(const Voice& voice) noexcept REALTIME {
  assert(voice.slot < slots_.size() && voice.signal < signals_.size());
  Slot& slot = slots_[voice.slot];
  slot.signal = &signals_[voice.signal];
  slot.rank = voice.rank;

  bool usable = mode_.delays == 1 ? slide_to<1>(voice) : slide_to<2>(voice);

  // An unusable or shed voice ramps to silence from where it was.
  if (shedding_.sheds(voice.rank)) usable = false;
  slot.audible = false;
  if (binaural_ != nullptr) {
    const Hrtf& hrtf = binaural_->hrtf;
    const auto place = usable ? hrtf.place(voice.from, slot.direction) : DirectionMesh::Place{};
    const std::int64_t from = binaural_->offset_ends[voice.slot];
    const std::int64_t to = usable ? fixed(0.5 * hrtf.low_itd_frames(place)) : from;
    set_layer_offset(voice.slot, voice.starts ? to : from, to);
    slot.audible = set_hrtf_gains(voice, usable, place);
    if (voice.starts && voice.has_onset) hold_gains(voice.slot);
    return;
  }
  std::array<float, kBandLanes> targets{};
  if (usable) set_targets(voice.gain, targets.data());
  if (panner_ == nullptr) {
    slot.audible = ramp_gains(gain_ramps(0, voice, targets.data()));
    if (voice.starts && voice.has_onset) hold_gains(voice.slot);
    return;
  }
  const ChannelGains gains = usable ? panner_->gains(voice.from) : ChannelGains{};
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    std::array<float, kBandLanes> panned;
    for (std::size_t lane = 0; lane < kBandLanes; ++lane)
      panned[lane] = targets[lane] * gains[kEars * p + lane % kEars];
    if (!ramp_gains(gain_ramps(p, voice, panned.data()))) continue;
    slot.audible = true;
    if (pairs_.size() > 1) pairs_[p].active.push_back(voice.slot);
  }
  if (voice.starts && voice.has_onset) hold_gains(voice.slot);
}

// Gains are constant at their targets: a sound that begins is not faded in.
void Mixer::hold_gains(std::uint32_t slot) noexcept REALTIME {
  change_gains(slot, [](const float* target, float* gain, std::size_t lanes) noexcept REALTIME {
    std::copy_n(target, lanes, gain);
    std::fill_n(gain + lanes, lanes, 0.0f);
  });
}

// From the current gains to `targets`.
GainRamps Mixer::gain_ramps(std::size_t pair, const Voice& voice,
                            const float* targets) noexcept REALTIME {
  const std::size_t lanes = static_cast<std::size_t>(layout_.lanes);
  return {&pairs_[pair].targets[voice.slot * lanes],
          &pairs_[pair].gains[2 * voice.slot * lanes],
          targets,
          lanes,
          slide_frames(voice),
          voice.starts};
}

}  // namespace clamor
