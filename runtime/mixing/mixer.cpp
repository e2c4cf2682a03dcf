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

MixMode without_head(MixMode mode) {
  if (mode.head) mode.eight_bands = true;
  mode.head = false;
  return mode;
}

}  // namespace

Mixer::Mixer(std::span<const PreparedSignal> signals, std::size_t slots, const MixMode& mode,
             const Panner* panner, const Hrtf* head, const HeadRotation* turns)
    : signals_(signals),
      mode_(mode),
      bus_mode_(without_head(mode)),
      panner_(panner),
      head_(head),
      lanes_(bus_mode_.gain_lanes()),
      lead_frames_(mode.head          ? kHrtfDelayFrames
                   : mode.eight_bands ? kBankDelayFrames
                                      : 0),
      slots_(slots),
      paths_(slots * kEars),
      gaps_(mode.head ? slots : 0),
      gap_ends_(gaps_.size()),
      wraps_(slots),
      pairs_(static_cast<std::size_t>(mode.pairs)),
      turns_(turns) {
  assert(panner == nullptr ? mode.pairs == 1 : panner->channels() == channels());
  assert(mode.pairs == 1 || mode.delays == 1);
  assert(mode.head == (head != nullptr));
  if (mode.head) {
    head_bank_ = std::make_unique<HrtfFilterBank>();
    crowd_ = std::make_unique<DiffuseHrtfEq>(*head);
    fine_ = std::make_unique<NarrowbandVoices>(slots, static_cast<std::size_t>(mode.fine_voices));
  }
  for (Pair& pair : pairs_) {
    pair.targets.resize(slots * static_cast<std::size_t>(lanes_));
    pair.gains.resize(2 * pair.targets.size());
    if (mode.pairs > 1 || mode.head) pair.active.reserve(slots);
  }
  active_.reserve(slots);
  once_.reserve(slots);
  if (turns_ != nullptr) make_room_for_turns();
  bus_gains_ =
      BusGains::of(mode.head ? HrtfFilterBank::bus_gains() : OctaveFilterBank::bus_gains());
}

void Mixer::begin(const Keyframe& keyframe, std::int64_t clock_frames) {
  clock_ = clock_frames - (mode_.two_layers() ? kBankTailFrames : 0);
  frame_ = kKeyframeFrames;
  clear_active();
  if (mode_.head) {
    choose_fine(keyframe);
    crowd_->begin();
  }
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
  rank_voices(keyframe);
  if (mode_.head) choose_fine(keyframe);
  if (turns_ != nullptr) keep(keyframe);
  load_segment(keyframe.voices, 0, has_turned() ? kKeyframeFrames / 3 : kKeyframeFrames);
}

// Voices slide to where they are to be so many frames of the period later.
void Mixer::load_segment(std::span<const Voice> voices, int elapsed, int frames) noexcept REALTIME {
  segment_ = frames == kKeyframeFrames       ? whole_segment()
             : frames == kKeyframeFrames / 3 ? segment_of(kKeyframeFrames / 3, 192)
                                             : segment_of(2 * kKeyframeFrames / 3, 384);
  elapsed_ = elapsed;
  frame_ = 0;
  shed_end_ = left_out_ > 0 ? std::min(kShedFrames, frames) : 0;
  clear_active();
  work_.loaded_voices += voices.size();
  if (mode_.head) {
    fine_->begin_segment();
    crowd_->begin();
  }
  const bool turns = turns_ != nullptr && facing_.is_known;
  const HeadRotation none(nullptr, 0);
  const HeadRotation& how = turns ? *turns_ : none;
  const HeadRotation::Turn turn(how, current_.facing, facing_),
      previous_turn(how, previous_.facing, facing_);
  for (std::size_t v = 0; v < voices.size(); ++v) {
    if (v + kVoicesAhead < voices.size()) prefetch(voices[v + kVoicesAhead].slot);
    if (turns)
      load_voice(interpolated_voice(voices[v], turn, previous_turn));
    else
      load_voice(voices[v]);
    activate(voices[v].slot);
  }
  if (mode_.head) head_bank_->slide_octaves(crowd_->levels(), frames);
  applied_ = turns ? facing_ : current_.facing;
  holding_ = false;
}

void Mixer::rank_voices(const Keyframe& keyframe) noexcept REALTIME {
  up_to_rank_.fill(0);
  for (const Voice& voice : keyframe.voices) ++up_to_rank_[voice.rank];
  for (std::size_t r = 1; r < up_to_rank_.size(); ++r) up_to_rank_[r] += up_to_rank_[r - 1];
  loaded_ = keyframe.voices.size();
  highest_rank_ = rank_for(allowed_);
  left_out_ = loaded_ - up_to_rank_[highest_rank_];
}

// The highest up to which there are no more than so many; of rank 0, all.
std::uint8_t Mixer::rank_for(std::size_t voices) const noexcept REALTIME {
  std::size_t rank = kHighestRank;
  while (rank > 0 && up_to_rank_[rank] > voices) --rank;
  return static_cast<std::uint8_t>(rank);
}

void Mixer::allow(std::size_t voices) noexcept REALTIME {
  allowed_ = voices;
  if (frame_ == segment_.frames) return;  // the next one comes first
  const std::uint8_t rank = rank_for(voices);
  // Near the segment's end, load() sees to it.
  const bool has_time = frame_ >= shed_end_ && frame_ + kShedFrames <= segment_.frames;
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
      stay(s);
      if (mode_.head) set_layer_offset(s, gap_ends_[s], gap_ends_[s]);
    }
    if (mode_.head) fine_->hold();
    holding_ = true;
  }
  const bool falling = hold_sounds();
  segment_ = whole_segment();
  elapsed_ = 0;
  frame_ = kKeyframeFrames - kStepFrames;
  const std::uint8_t rank = rank_for(allowed_);
  if (falling || rank >= highest_rank_) return;
  frame_ = kKeyframeFrames - kShedFrames;
  fade_above(rank);
}

// Before the kernel: where those go on that play once, also where there is nothing to read.
void Mixer::advance_once(int frames) noexcept REALTIME {
  for (const std::uint32_t s : once_)
    for (std::size_t e = 0; e < static_cast<std::size_t>(mode_.delays); ++e) {
      VoicePath path = paths_[s * kEars + e];
      path.position = slots_[s].position[e];
      slots_[s].position[e] = path.position_at(frames);
    }
}

// After it, which has made all others go on, unless it had them pair by pair.
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
  if (frame_ + frames == segment_.knot)
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
  MixJob job{paths_.data(), here.gains.data(), active.data(), active.size(), frame_,
             frames,        buses_.high,       buses_.low};
  if (mode_.pairs == 1) job.next = {paths_.data(), nullptr, wraps_.data()};
  mix_voices(mode_, job);
  if (mode_.eight_bands) {
    here.bank.process(buses_, frames, interleaved, channels());
    return;
  }
  const auto interleave = [&](auto stride) noexcept REALTIME {
    for (int f = 0; f < frames; ++f)
      for (int e = 0; e < kEars; ++e) interleaved[f * stride + e] = buses_.high[e * kMaxFrames + f];
  };
  if (pairs_.size() == 1)
    interleave(std::integral_constant<int, kEars>{});  // in vectors
  else
    interleave(channels());
}

void Mixer::mix_head(int frames, float* interleaved) noexcept REALTIME {
  head_bank_->clear();
  const MixContinuation next{paths_.data(), gaps_.data(), wraps_.data()};
  fine_->mix(mode_, next, frame_, frames, head_bank_->high(), head_bank_->low());
  const Pair& pair = pairs_[0];
  MixBuses& octaves = head_bank_->octaves();
  work_.voice_frames += (fine_->heard() + pair.active.size()) * static_cast<std::size_t>(frames);
  mix_voices(bus_mode_, {paths_.data(), pair.gains.data(), pair.active.data(), pair.active.size(),
                         frame_, frames, octaves.high, octaves.low, gaps_.data(), next});
  fine_->put_back(next);
  head_bank_->process(frames, interleaved);
}

void Mixer::mix(float* interleaved, int steps) noexcept REALTIME {
  assert(steps >= 1 && steps <= steps_left());
  const FlushDenormals no_denormals;
  const int frames = steps * kStepFrames;
  advance_once(frames);
  if (mode_.head)
    mix_head(frames, interleaved);
  else
    for (std::size_t p = 0; p < pairs_.size(); ++p) mix_pair(p, frames, interleaved + kEars * p);
  advance(frames);
  clock_ += frames;
  frame_ += frames;
  if (frame_ == shed_end_ && frame_ < segment_.frames) drop_shed();
}

}  // namespace clamor
