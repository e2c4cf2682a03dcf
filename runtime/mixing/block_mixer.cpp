#include "runtime/mixing/block_mixer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "common/platform/thread.h"

namespace clamor {

namespace {

// A device may ask for larger blocks than announced. The keyframe queue has room for blocks of this
// size, and keyframes are made as far ahead as actual blocks need.
constexpr int kLargestUnexpected_frames = 4096;

}  // namespace

std::size_t max_keyframes_ahead(int block_frames) {
  return keyframes_ahead(std::max(block_frames, kLargestUnexpected_frames));
}

BlockMixer::BlockMixer(PlayableSignals signals, std::size_t slots, const MixMode& mode,
                       const Panner* panner, const Hrtf* head, SoundLoader* sounds,
                       const BlockOptions& options)
    : options_(options),
      sounds_(sounds),
      demand_(options.block_frames),
      queue_(max_keyframes_ahead(options.block_frames), slots),
      mixer_(signals, slots, mode, panner, head, options.turns),
      limiter_(options.limit ? std::make_unique<Limiter>(channels()) : nullptr) {
  mixed_.samples.resize(channels() * kMaxFrames);
}

bool BlockMixer::wants_keyframe(double lead_s, bool in_real_time) const {
  return published_ < 2 || demand_.wants_another(queue_.size(), lead_s, in_real_time);
}

BlockMixer::KeyframeDemand::KeyframeDemand(int block_frames)
    : most_(max_keyframes_ahead(block_frames)),
      ahead_(keyframes_ahead(block_frames)),
      block_frames_(block_frames) {}

// The next block may take as many frames at once as the largest so far.
bool BlockMixer::KeyframeDemand::wants_another(std::size_t waiting, double lead_s,
                                               bool in_real_time) const {
  if (waiting >= most_) return false;
  if (!in_real_time && waiting < ahead_.load(std::memory_order_relaxed)) return true;
  const double left_frames =
      static_cast<double>(waiting) * kKeyframeFrames + frames_left_.load(std::memory_order_relaxed);
  return left_frames < block_frames_.load(std::memory_order_relaxed) + lead_s * kSampleRate_hz;
}

// Records a block size. If it is the largest so far, keyframes are made further ahead from now on.
void BlockMixer::KeyframeDemand::expect(std::size_t block_frames) noexcept REALTIME {
  if (block_frames <= largest_block_frames_) return;
  largest_block_frames_ = block_frames;
  const auto fits =
      static_cast<int>(std::min<std::size_t>(block_frames, kLargestUnexpected_frames));
  ahead_.store(std::max(ahead_.load(std::memory_order_relaxed), keyframes_ahead(fits)),
               std::memory_order_relaxed);
  block_frames_.store(std::max(block_frames_.load(std::memory_order_relaxed), fits),
                      std::memory_order_relaxed);
}

void BlockMixer::skip(std::uint64_t frames) {
  assert(published_ == 0);
  counters_.held_frames.fetch_add(frames, std::memory_order_relaxed);
  if (sounds_ != nullptr) sounds_->mark_quiescent(static_cast<std::int64_t>(held_frames()));
}

void BlockMixer::publish(const Keyframe& written) {
  if (published_ == 2) {
    meter_audio_thread();
    queue_.publish();
    return;
  }
  if (published_++ == 0) {  // the limiter's delay makes no keyframe later
    mixer_.begin(written, static_cast<std::int64_t>(held_frames()) - mixer_.lead_frames());
    return;
  }
  if (sounds_ != nullptr) sounds_->mark_quiescent(mixer_.clock_frames());
  mixer_.load(written);
  mix_lead();
  demand_.set_frames_left(mixer_.frames_left());
  begun_.store(true, std::memory_order_release);
}

// Mixes up to time 0; frames beyond are kept for the first block.
void BlockMixer::mix_lead() {
  static_assert(kHrtfDelayFrames + kLimiterDelayFrames < kKeyframeFrames);
  int left = mixer_.lead_frames() + (limiter_ != nullptr ? kLimiterDelayFrames : 0);
  while (left > 0) {
    mix_steps(std::min((left + kStepFrames - 1) / kStepFrames, mixer_.steps_left()));
    const int mixed = static_cast<int>(mixed_.end / channels());
    mixed_.read = static_cast<std::size_t>(std::min(left, mixed)) * channels();
    left -= mixed;
  }
  for (std::atomic<float>& peak : counters_.peak) peak.store(0, std::memory_order_relaxed);
}

std::size_t BlockMixer::MixedSteps::take(std::span<float> output) noexcept REALTIME {
  const std::size_t count = std::min(output.size(), end - read);
  std::copy_n(samples.begin() + static_cast<std::ptrdiff_t>(read), count, output.begin());
  read += count;
  return count;
}

void BlockMixer::mix(std::span<float> interleaved) noexcept REALTIME {
  demand_.expect(interleaved.size() / channels());
  bool held = false;
  if (!begun_.load(std::memory_order_acquire)) {
    std::fill(interleaved.begin(), interleaved.end(), 0.0f);
    held = true;
  } else {
    const double start_s = options_.adapt ? options_.clock.now() : 0;
    std::size_t sounding = 0, frames = 0;
    for (std::size_t i = 0; i < interleaved.size();) {
      if (mixed_.is_empty()) {
        held = mix_more(interleaved.size() - i) || held;
        frames += mixed_.end / channels();
        sounding = std::max(sounding, mixer_.sounding());
      }
      i += mixed_.take(interleaved.subspan(i));
    }
    demand_.set_frames_left(mixer_.frames_left());
    if (options_.adapt && frames > 0) tell_load(options_.clock.now() - start_s, frames, sounding);
  }
  if (held) counters_.held_blocks.fetch_add(1, std::memory_order_relaxed);
}

// Mixes steps for up to `samples` samples. Returns true if a due keyframe was missing.
bool BlockMixer::mix_more(std::size_t samples) noexcept REALTIME {
  bool held = false;
  if (options_.turns != nullptr) mixer_.turn_head(axes_.latest());
  const Keyframe* const keyframe = mixer_.wants_keyframe() ? queue_.readable() : nullptr;
  if (options_.adapt && keyframe != nullptr) load_.expect(keyframe->voices.size());
  mixer_.allow(load_.allowed());
  if (mixer_.wants_keyframe()) {
    if (sounds_ != nullptr) sounds_->mark_quiescent(mixer_.clock_frames());
    if (keyframe != nullptr) {
      mixer_.load(*keyframe);
      queue_.release();
    } else {
      if (!mixer_.rotate_while_holding()) mixer_.hold();
      held = true;
    }
  } else {
    mixer_.follow_head();
  }
  const std::size_t step = channels() * kStepFrames;
  const auto steps =
      static_cast<int>(std::min<std::size_t>((samples + step - 1) / step, mixer_.steps_left()));
  mix_steps(steps);
  if (mixer_.holds())
    counters_.held_frames.fetch_add(static_cast<std::uint64_t>(steps) * kStepFrames,
                                    std::memory_order_relaxed);
  return held;
}

void BlockMixer::mix_steps(int steps) noexcept REALTIME {
  mixer_.mix(mixed_.samples.data(), steps);
  mixed_.end = static_cast<std::size_t>(steps) * channels() * kStepFrames;
  mixed_.read = 0;
  finish_mix();
}

void BlockMixer::meter_audio_thread() {
  const LoadClock& clock = options_.clock;
  const double mixing_s = counters_.mixing_s.load(std::memory_order_acquire);
  if (clock.cpu_s == nullptr || mixing_s == 0) return;
  const clockid_t thread = counters_.audio_thread.load(std::memory_order_relaxed);
  audio_thread_.took({mixing_s, clock.cpu_s(clock.context, thread)}, thread);
  counters_.own_share.store(1 - audio_thread_.waiting_share(), std::memory_order_relaxed);
}

void BlockMixer::AudioThread::took(const WorkTime& so_far_s, clockid_t thread) {
  const WorkTime since_s = so_far_s - std::exchange(so_far_s_, so_far_s);
  if (std::exchange(thread_, thread) == thread) recent_s_ = recent_s_ * kForget + since_s;
}

double BlockMixer::AudioThread::waiting_share() const {
  return recent_s_.passed > 0 ? std::clamp(1 - recent_s_.cpu / recent_s_.passed, 0.0, 1.0) : 0;
}

// Measures how long mixing took.
void BlockMixer::tell_load(double took_s, std::size_t frames,
                           std::size_t sounding) noexcept REALTIME {
  if (options_.clock.cpu_s != nullptr)
    if (const auto thread = clock_of_this_thread())
      counters_.audio_thread.store(*thread, std::memory_order_relaxed);
  counters_.mixing_s.store(counters_.mixing_s.load(std::memory_order_relaxed) + took_s,
                           std::memory_order_release);
  measured_.took_s += took_s;
  measured_.frames += frames;
  measured_.sounding = std::max(measured_.sounding, sounding);
  if (measured_.frames >= kKeyframeFrames) {
    const double own_share = counters_.own_share.load(std::memory_order_relaxed);
    load_.mixed({measured_.took_s, measured_.took_s * own_share},
                static_cast<double>(measured_.frames) / kSampleRate_hz, measured_.sounding);
    measured_ = {};
  }
  const auto now_shed = static_cast<std::uint32_t>(mixer_.shed());
  counters_.loaded.store(static_cast<std::uint32_t>(mixer_.voices()), std::memory_order_relaxed);
  counters_.shed.store(now_shed, std::memory_order_relaxed);
  if (now_shed > counters_.max_shed_voices.load(std::memory_order_relaxed))
    counters_.max_shed_voices.store(now_shed, std::memory_order_relaxed);
  if (now_shed > 0) counters_.shedding_blocks.fetch_add(1, std::memory_order_relaxed);
  counters_.mixer_is_full.store(load_.is_full(mixer_.voices()), std::memory_order_relaxed);
}

// Applies the output gain and the limiter, and updates peaks and statistics.
void BlockMixer::finish_mix() noexcept REALTIME {
  const std::span<float> mixed = std::span(mixed_.samples).first(mixed_.end);
  const std::size_t channel_count = channels();
  const float gain = options_.gain;
  for (float& sample : mixed) sample *= gain;
  if (limiter_ != nullptr) limiter_->process(mixed);
  std::array<float, kMaxChannels> highest{};
  std::uint64_t clipped = 0;
  for (std::size_t f = 0; f < mixed.size(); f += channel_count) {
    bool clips = false;
    for (std::size_t c = 0; c < channel_count; ++c) {
      const float sample = mixed[f + c];
      highest[c] = std::max(highest[c], std::abs(sample));
      clips = clips || std::abs(sample) > 1;
    }
    clipped += clips;
  }
  for (std::size_t c = 0; c < channel_count; ++c)
    if (highest[c] > counters_.peak[c].load(std::memory_order_relaxed))
      counters_.peak[c].store(highest[c], std::memory_order_relaxed);
  counters_.clipped_frames.fetch_add(clipped, std::memory_order_relaxed);
  counters_.bad_voices.store(mixer_.bad_voices(), std::memory_order_relaxed);
  counters_.late_voices.store(mixer_.late_voices(), std::memory_order_relaxed);
}

double BlockMixer::shed_share() const {
  const double of = counters_.loaded.load(std::memory_order_relaxed);
  return of > 0 ? counters_.shed.load(std::memory_order_relaxed) / of : 0;
}

BlockStatistics BlockMixer::statistics() {
  BlockStatistics now;
  now.held_blocks = counters_.held_blocks.load(std::memory_order_relaxed);
  now.clipped_frames = counters_.clipped_frames.load(std::memory_order_relaxed);
  now.bad_voices = counters_.bad_voices.load(std::memory_order_relaxed);
  now.late_voices = counters_.late_voices.load(std::memory_order_relaxed);
  now.shed_voices = counters_.shed.load(std::memory_order_relaxed);
  now.max_shed_voices = counters_.max_shed_voices.load(std::memory_order_relaxed);
  now.shedding_blocks = counters_.shedding_blocks.load(std::memory_order_relaxed);
  if (limiter_ != nullptr) now.limited = limiter_->worked();
  for (std::size_t c = 0; c < channels(); ++c)
    now.peak[c] = counters_.peak[c].exchange(0, std::memory_order_relaxed);
  return now;
}

}  // namespace clamor
