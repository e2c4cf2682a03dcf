#include "runtime/mixer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "runtime/flush_denormals.h"

namespace clamor {

namespace {

constexpr std::int64_t kFixedOne = std::int64_t{1} << 32;
constexpr double kFixedOne_f = static_cast<double>(kFixedOne);
constexpr double kFastestBent = 0.99;  // frames per frame
constexpr std::size_t kVoicesAhead = 6;
constexpr double kLongestDelay_frames = 1 << 30;
constexpr float kLoudest = 1e6f;  // 120 dB above full scale: no sum of voices overflows

static_assert(kKeyframeFrames % kStepFrames == 0 && kBankTailFrames % kStepFrames == 0);

bool is_usable(double delay_frames) {
  return std::abs(delay_frames) < kLongestDelay_frames;  // false for NaN
}

bool is_usable(const Voice& voice) {
  if (!(dot(voice.from, voice.from) < 1.01f)) return false;
  for (int e = 0; e < kEars; ++e) {
    if (!is_usable(voice.delay_frames[e])) return false;
    if (voice.starts && !is_usable(voice.start_delay_frames[e])) return false;
    bool quiet = true;
    for (const float gain : voice.gain[e]) quiet &= std::abs(gain) <= kLoudest;  // false for NaN
    if (!quiet) return false;
  }
  return true;
}

MixMode without_head(MixMode mode) {
  if (mode.head) mode.eight_bands = true;
  mode.head = false;
  return mode;
}

std::int64_t fixed(double frames) { return std::llrint(frames * kFixedOne_f); }

}  // namespace

Mixer::Mixer(std::span<const PreparedSignal> signals, std::size_t slots, const MixMode& mode,
             const Panner* panner, const Head* head)
    : signals_(signals),
      mode_(mode),
      bus_mode_(without_head(mode)),
      panner_(panner),
      head_(head),
      lanes_(bus_mode_.gain_lanes()),
      lead_frames_(mode.head          ? kHeadDelayFrames
                   : mode.eight_bands ? kBankDelayFrames
                                      : 0),
      slots_(slots),
      paths_(slots * kEars),
      gaps_(mode.head ? slots : 0),
      gap_ends_(gaps_.size()),
      wraps_(slots),
      pairs_(static_cast<std::size_t>(mode.pairs)) {
  assert(panner == nullptr ? mode.pairs == 1 : panner->channels() == channels());
  assert(mode.pairs == 1 || mode.delays == 1);
  assert(mode.head == (head != nullptr));
  if (mode.head) {
    head_bank_ = std::make_unique<HeadBank>();
    crowd_ = std::make_unique<CrowdColour>(*head);
    fine_ = std::make_unique<FineVoices>(slots, static_cast<std::size_t>(mode.fine_voices));
  }
  for (Pair& pair : pairs_) {
    pair.targets.resize(slots * static_cast<std::size_t>(lanes_));
    pair.gains.resize(2 * pair.targets.size());
    if (mode.pairs > 1 || mode.head) pair.active.reserve(slots);
  }
  active_.reserve(slots);
  once_.reserve(slots);
  bus_gains_ = BusGains::of(mode.head ? HeadBank::bus_gains() : OctaveBank::bus_gains());
}

void Mixer::begin(const Keyframe& keyframe, std::int64_t clock_frames) {
  clock_ = clock_frames - (mode_.two_layers() ? kBankTailFrames : 0);
  frame_ = kKeyframeFrames;
  clear_active();
  if (mode_.head) choose_fine(keyframe);
  for (const Voice& voice : keyframe.voices) {
    Voice started = voice;
    started.starts = true;
    started.start_delay_frames = started.delay_frames;
    load_voice(started);
    activate(voice.slot);
  }
  if (mode_.head) head_bank_->slide_octaves(crowd_->levels(), 0);
  holding_ = false;
  std::vector<float> unheard(static_cast<std::size_t>(channels() * kStepFrames));
  while (clock_ < clock_frames) {
    hold();
    step(unheard.data());
  }
  frame_ = kKeyframeFrames;
}

void Mixer::load(const Keyframe& keyframe) noexcept REALTIME {
  if (holding_) end_hold();
  clear_active();
  work_.loaded_voices += keyframe.voices.size();
  rank_voices(keyframe);
  if (mode_.head) choose_fine(keyframe);
  for (std::size_t v = 0; v < keyframe.voices.size(); ++v) {
    if (v + kVoicesAhead < keyframe.voices.size()) prefetch(keyframe.voices[v + kVoicesAhead].slot);
    load_voice(keyframe.voices[v]);
    activate(keyframe.voices[v].slot);
  }
  if (mode_.head) head_bank_->slide_octaves(crowd_->levels(), kKeyframeFrames);
  frame_ = 0;
  holding_ = false;
}

void Mixer::rank_voices(const Keyframe& keyframe) noexcept REALTIME {
  up_to_rank_.fill(0);
  for (const Voice& voice : keyframe.voices) ++up_to_rank_[voice.rank];
  for (std::size_t r = 1; r < up_to_rank_.size(); ++r) up_to_rank_[r] += up_to_rank_[r - 1];
  loaded_ = keyframe.voices.size();
  highest_rank_ = rank_for(allowed_);
  left_out_ = loaded_ - up_to_rank_[highest_rank_];
  shed_end_ = left_out_ > 0 ? kShedFrames : 0;
}

// The highest up to which there are no more than so many; of rank 0, all.
std::uint8_t Mixer::rank_for(std::size_t voices) const noexcept REALTIME {
  std::size_t rank = kHighestRank;
  while (rank > 0 && up_to_rank_[rank] > voices) --rank;
  return static_cast<std::uint8_t>(rank);
}

void Mixer::allow(std::size_t voices) noexcept REALTIME {
  allowed_ = voices;
  if (frame_ == kKeyframeFrames) return;  // load() comes next
  const std::uint8_t rank = rank_for(voices);
  // Near the segment's end, load() sees to it.
  const bool has_time = frame_ >= shed_end_ && frame_ + kShedFrames <= kKeyframeFrames;
  if (rank < highest_rank_ && has_time) fade_above(rank);
}

// In straight lines from where gains are now.
void Mixer::fade_above(std::uint8_t rank) noexcept REALTIME {
  shed_end_ = frame_ + kShedFrames;
  highest_rank_ = rank;
  left_out_ = loaded_ - up_to_rank_[rank];
  const float here = static_cast<float>(frame_) / kGainFrames;
  constexpr float way = static_cast<float>(kShedFrames) / kGainFrames;
  for (const std::uint32_t s : active_)
    if (slots_[s].rank > rank)
      change_gains(s, [&](float* target, float* gain, std::size_t lanes) noexcept REALTIME {
        for (std::size_t lane = 0; lane < lanes; ++lane) {
          const float slope = -(gain[lane] + here * gain[lanes + lane]) / way;
          gain[lanes + lane] = slope;
          gain[lane] = -slope * (here + way);
        }
        std::fill_n(target, lanes, 0.0f);
      });
}

void Mixer::drop_shed() noexcept REALTIME {
  const auto is_shed = [this](std::uint32_t s) { return slots_[s].rank > highest_rank_; };
  std::erase_if(active_, is_shed);
  std::erase_if(once_, is_shed);
  for (Pair& pair : pairs_) std::erase_if(pair.active, is_shed);
  if (mode_.head) fine_->drop(is_shed);
}

void Mixer::clear_active() noexcept REALTIME {
  active_.clear();
  once_.clear();
  for (Pair& pair : pairs_) pair.active.clear();
}

void Mixer::activate(std::uint32_t slot) noexcept REALTIME {
  if (!slots_[slot].heard) return;
  active_.push_back(slot);
  const PreparedSignal& signal = *slots_[slot].signal;
  if (!signal.loops()) once_.push_back(slot);
  wraps_[slot] = signal.loops() ? signal.wrap() : std::numeric_limits<std::int64_t>::max();
}

// The frame read is clock + lead - delay.
void Mixer::place(std::uint32_t slot, int ear, std::int64_t delay) noexcept REALTIME {
  const PreparedSignal& signal = *slots_[slot].signal;
  const std::int64_t whole = clock_ + lead_frames_ + (-delay >> 32);
  const std::int64_t position = signal.near(whole) * kFixedOne + (-delay & (kFixedOne - 1));
  slots_[slot].position[static_cast<std::size_t>(ear)] = position;
  signal.place(position, paths_[slot * kEars + static_cast<std::size_t>(ear)]);
}

// The ears' delays of the low layer go apart from those of the high one in a straight line.
void Mixer::set_gap(std::uint32_t slot, std::int64_t from, std::int64_t to) noexcept REALTIME {
  gaps_[slot] = {from, (to - from) / kKeyframeFrames};
  gap_ends_[slot] = to;
}

// Two parabolas with slopes a at the beginning, b at the knot and c at the end, of m and n steps:
// each step's slope is its middle's, so what they change in all is, in steps,
// m (a + b) / 2 + n (b + c) / 2. That gives b.
void Mixer::slide(std::uint32_t slot, int ear, double change_frames,
                  bool starts) noexcept REALTIME {
  constexpr double m = 1.0 * kKnotFrames / kStepFrames, n = 1.0 * kKeyframeFrames / kStepFrames - m;
  Slide& slide = slots_[slot].slide[static_cast<std::size_t>(ear)];
  const double mean = change_frames / kKeyframeFrames;
  double a = mean, b = mean, c = mean;
  if (!starts) {
    a = slide.end;
    c = 1.5 * mean - 0.5 * slide.mean;
    b = (2 * (m + n) * mean - m * a - n * c) / (m + n);
    if (std::max({std::abs(a), std::abs(b), std::abs(c)}) > kFastestBent) a = b = c = mean;
  }
  slide = {mean, c};
  const auto parabola = [](double from, double to, double steps) {
    const double bend = (to - from) / steps;
    return Parabola{kFixedOne - fixed(from + 0.5 * bend), -fixed(bend)};
  };
  VoicePath& path = paths_[slot * kEars + static_cast<std::size_t>(ear)];
  const Parabola before_knot = parabola(a, b, m);
  path.step = before_knot.step;
  path.bend = before_knot.bend;
  slots_[slot].after_knot[static_cast<std::size_t>(ear)] = parabola(b, c, n);
}

void Mixer::set_targets(const std::array<Bands, kEars>& gain,
                        float* targets) const noexcept REALTIME {
  if (bus_mode_.eight_bands) return bus_lanes(bus_gains_, gain, targets);
  for (std::size_t e = 0; e < kEars; ++e) targets[e] = gain[e][0];
}

float Mixer::power_of(const Voice& voice) const noexcept REALTIME {
  const Bands& mean_square = signals_[voice.signal].mean_square();
  float sum = 0;
  for (const Bands& ear : voice.gain)
    for (std::size_t b = 0; b < kBandCount; ++b) sum += mean_square[b] * ear[b] * ear[b];
  return sum;
}

void Mixer::choose_fine(const Keyframe& keyframe) noexcept REALTIME {
  fine_->begin();
  crowd_->begin();
  for (const Voice& voice : keyframe.voices)
    if (voice.rank <= highest_rank_) fine_->offer(voice.slot, power_of(voice));
  fine_->end();
}

// Octaves times the head's levels, in its bands or in octaves. True if anything is heard.
bool Mixer::set_colours(const Voice& voice, bool usable,
                        const DirectionMesh::Place& place) noexcept REALTIME {
  const bool fine = usable && fine_->chosen(voice.slot);
  std::array<float, kHeadLanes> colours;
  if (fine) {
    const auto levels = head_->hear(place);
    const auto across = head_->hear_across(place);
    for (std::size_t e = 0; e < kEars; ++e) {
      const HeadLevels own = HeadBank::levels_of(voice.gain[e]);
      for (std::size_t j = 0; j < kHeadBands; ++j) colours[kEars * j + e] = own[j] * levels[e][j];
      const Quadratures at = HeadBank::at_quadratures(own);
      for (std::size_t k = 0; k < kHeadQuadratures; ++k)
        colours[kEars * (kHeadBands + k) + e] = at[k] * across[e][k];
    }
  }
  std::array<float, kBandLanes> targets{};
  if (usable && !fine) {
    const Bands& mean_square = signals_[voice.signal].mean_square();
    auto gain = head_->hear_octaves(place);
    std::array<Bands, kEars> power;
    for (std::size_t e = 0; e < kEars; ++e)
      for (std::size_t b = 0; b < kBandCount; ++b) {
        power[e][b] = mean_square[b] * voice.gain[e][b] * voice.gain[e][b];
        gain[e][b] *= voice.gain[e][b];
      }
    crowd_->add(place, power);
    set_targets(gain, targets.data());
  }
  const bool in_bands =
      fine_->set(voice.slot, fine ? colours.data() : nullptr, voice.starts, slide_frames(voice));
  const bool in_octaves = set_gains(0, voice, targets.data());
  if (in_octaves) pairs_[0].active.push_back(voice.slot);
  return in_bands || in_octaves;
}

// What is known of a voice is all over memory.
void Mixer::prefetch(std::uint32_t slot) const noexcept REALTIME {
  const auto lines = [](const void* first, std::size_t bytes) noexcept {
    for (std::size_t at = 0; at < bytes; at += 64)
      __builtin_prefetch(static_cast<const char*>(first) + at, 1);
  };
  const std::size_t lanes = static_cast<std::size_t>(lanes_);
  lines(&slots_[slot], sizeof(Slot));
  lines(&paths_[slot * std::size_t{kEars}], kEars * sizeof(VoicePath));
  if (mode_.head) lines(&gaps_[slot], sizeof(LayerGap));
  for (const Pair& pair : pairs_) {
    lines(&pair.targets[slot * lanes], lanes * sizeof(float));
    lines(&pair.gains[2 * slot * lanes], 2 * lanes * sizeof(float));
  }
}

void Mixer::load_voice(const Voice& voice) noexcept REALTIME {
  assert(voice.slot < slots_.size() && voice.signal < signals_.size());
  Slot& slot = slots_[voice.slot];
  slot.signal = &signals_[voice.signal];
  slot.rank = voice.rank;

  bool usable = is_usable(voice);
  std::array<double, kEars> change_frames{};
  std::array<std::int64_t, kEars> now = slot.delay;
  for (int e = 0; e < mode_.delays && usable; ++e) {
    if (voice.starts) now[e] = fixed(voice.start_delay_frames[e]);
    change_frames[e] = static_cast<double>(fixed(voice.delay_frames[e]) - now[e]) / kFixedOne_f;
    usable = std::abs(change_frames[e]) < kKeyframeFrames;
  }
  if (!usable) {
    ++bad_voices_;
    change_frames = {};
    now = slot.delay;
  }
  for (int e = 0; e < mode_.delays; ++e) {
    slide(voice.slot, e, change_frames[e], voice.starts || !usable);
    place(voice.slot, e, now[e]);
    slot.delay[e] = usable ? fixed(voice.delay_frames[e]) : now[e];
  }
  usable = may_sound(voice.slot, now, change_frames) && usable;

  // Down to silence from where it was, if it cannot be used or there is no time for it.
  if (voice.rank > highest_rank_) usable = false;
  slot.heard = false;
  if (head_ != nullptr) {
    const auto place = usable ? head_->place(voice.from) : DirectionMesh::Place{};
    const std::int64_t from = gap_ends_[voice.slot];
    const std::int64_t to = usable ? fixed(0.5 * head_->low_lag_frames(place)) : from;
    set_gap(voice.slot, voice.starts ? to : from, to);
    slot.heard = set_colours(voice, usable, place);
    return;
  }
  std::array<float, kBandLanes> targets{};
  if (usable) set_targets(voice.gain, targets.data());
  if (panner_ == nullptr) {
    slot.heard = set_gains(0, voice, targets.data());
    return;
  }
  const ChannelGains gains = usable ? panner_->gains(voice.from) : ChannelGains{};
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    std::array<float, kBandLanes> panned;
    for (std::size_t lane = 0; lane < kBandLanes; ++lane)
      panned[lane] = targets[lane] * gains[kEars * p + lane % kEars];
    if (!set_gains(p, voice, panned.data())) continue;
    slot.heard = true;
    if (pairs_.size() > 1) pairs_[p].active.push_back(voice.slot);
  }
}

// From where they are to `targets`. True if the pair hears anything of it.
bool Mixer::set_gains(std::size_t pair, const Voice& voice,
                      const float* targets) noexcept REALTIME {
  const std::size_t lanes = static_cast<std::size_t>(lanes_);
  return slide_gains({&pairs_[pair].targets[voice.slot * lanes],
                      &pairs_[pair].gains[2 * voice.slot * lanes], targets, lanes,
                      slide_frames(voice), voice.starts});
}

void Mixer::hold() noexcept REALTIME {
  if (shed_end_ > 0) drop_shed();
  shed_end_ = 0;
  if (!holding_) {
    const std::size_t lanes = static_cast<std::size_t>(lanes_);
    for (const std::uint32_t s : active_) {
      for (Pair& pair : pairs_) {
        std::copy_n(&pair.targets[s * lanes], lanes, &pair.gains[2 * s * lanes]);
        std::fill_n(&pair.gains[(2 * s + 1) * lanes], lanes, 0.0f);
      }
      for (int e = 0; e < mode_.delays; ++e) {
        slide(s, e, 0, true);
        place(s, e, slots_[s].delay[e]);
      }
      if (mode_.head) set_gap(s, gap_ends_[s], gap_ends_[s]);
    }
    if (mode_.head) fine_->hold();
    holding_ = true;
  }
  const bool falling = hold_sounds();
  frame_ = kKeyframeFrames - kStepFrames;
  const std::uint8_t rank = rank_for(allowed_);
  if (falling || rank >= highest_rank_) return;
  frame_ = kKeyframeFrames - kShedFrames;
  fade_above(rank);
}

void Mixer::advance(int frames) noexcept REALTIME {
  const auto ears = static_cast<std::size_t>(mode_.delays);
  for (const std::uint32_t s : once_)
    for (std::size_t e = 0; e < ears; ++e) {
      VoicePath path = paths_[s * kEars + e];
      path.position = slots_[s].position[e];
      slots_[s].position[e] = path.position_at(frames);
    }
  for (const std::uint32_t s : active_)
    for (std::size_t e = 0; e < ears; ++e) {
      VoicePath& path = paths_[s * kEars + e];
      path.position = path.position_at(frames);
      path.step = path.step_at(frames);
      path.position -= path.position >= wraps_[s] ? wraps_[s] : 0;
    }
  if (mode_.head)
    for (const std::uint32_t s : active_) gaps_[s].ahead += frames * gaps_[s].step;
  for (const std::uint32_t s : once_)
    for (std::size_t e = 0; e < ears; ++e)
      slots_[s].signal->place(slots_[s].position[e], paths_[s * kEars + e]);
  if (frame_ + frames == kKnotFrames)
    for (const std::uint32_t s : active_)
      for (std::size_t e = 0; e < ears; ++e) {
        paths_[s * kEars + e].step = slots_[s].after_knot[e].step;
        paths_[s * kEars + e].bend = slots_[s].after_knot[e].bend;
      }
}

void Mixer::mix_pair(std::size_t pair, int frames, float* interleaved) noexcept REALTIME {
  Pair& here = pairs_[pair];
  const auto& active = pairs_.size() > 1 ? here.active : active_;
  std::fill(std::begin(buses_.high), std::end(buses_.high), 0.0f);
  std::fill(std::begin(buses_.low), std::end(buses_.low), 0.0f);
  work_.voice_frames += active.size() * static_cast<std::size_t>(frames);
  mix_voices(mode_, {paths_.data(), here.gains.data(), active.data(), active.size(), frame_, frames,
                     buses_.high, buses_.low});
  if (mode_.eight_bands) {
    here.bank.process(buses_, frames, interleaved, channels());
    return;
  }
  for (int f = 0; f < frames; ++f)
    for (int e = 0; e < kEars; ++e)
      interleaved[f * channels() + e] = buses_.high[e * kMostFrames + f];
}

void Mixer::mix_head(int frames, float* interleaved) noexcept REALTIME {
  head_bank_->clear();
  fine_->mix(mode_, paths_.data(), gaps_.data(), frame_, frames, head_bank_->high(),
             head_bank_->low());
  const Pair& pair = pairs_[0];
  MixBuses& octaves = head_bank_->octaves();
  work_.voice_frames += (fine_->heard() + pair.active.size()) * static_cast<std::size_t>(frames);
  mix_voices(bus_mode_, {paths_.data(), pair.gains.data(), pair.active.data(), pair.active.size(),
                         frame_, frames, octaves.high, octaves.low, gaps_.data()});
  head_bank_->process(frames, interleaved);
}

void Mixer::mix(float* interleaved, int steps) noexcept REALTIME {
  assert(steps >= 1 && steps <= steps_left());
  const FlushDenormals no_denormals;
  const int frames = steps * kStepFrames;
  if (mode_.head)
    mix_head(frames, interleaved);
  else
    for (std::size_t p = 0; p < pairs_.size(); ++p) mix_pair(p, frames, interleaved + kEars * p);
  advance(frames);
  clock_ += frames;
  frame_ += frames;
  if (frame_ == shed_end_ && frame_ < kKeyframeFrames) drop_shed();
}

}  // namespace clamor
