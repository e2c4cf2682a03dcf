#include "runtime/mixing/block_mixer.h"

#include <algorithm>
#include <cmath>

namespace clamor {

namespace {

// A device may ask for larger blocks than announced. The keyframe queue has room for blocks of this
// size, and keyframes are made as far ahead as actual blocks need.
constexpr int kLargestUnexpected_frames = 4096;

}  // namespace

// Two segments more than the longest block: the one being mixed and the one that may end within the
// block.
std::size_t keyframes_ahead(int block_frames) noexcept REALTIME {
  return 2 + static_cast<std::size_t>((block_frames + kKeyframeFrames - 1) / kKeyframeFrames);
}

std::size_t max_keyframes_ahead(int block_frames) {
  return keyframes_ahead(std::max(block_frames, kLargestUnexpected_frames));
}

BlockMixer::BlockMixer(std::span<const PreparedSignal> signals, std::size_t slots,
                       const MixMode& mode, const Panner* panner, const Hrtf* head,
                       SoundLoader* sounds, const BlockOptions& options)
    : channels_(static_cast<std::size_t>(kEars * mode.pairs)),
      gain_(options.gain),
      adapting_(options.adapt),
      clock_(options.clock),
      sounds_(sounds),
      ahead_(keyframes_ahead(options.block_frames)),
      block_frames_(options.block_frames),
      turns_(options.turns != nullptr),
      queue_(max_keyframes_ahead(options.block_frames), slots),
      mixer_(signals, slots, mode, panner, head, options.turns),
      limiter_(options.limit ? std::make_unique<Limiter>(channels_) : nullptr),
      lead_frames_(mixer_.lead_frames() + (options.limit ? kLimiterDelayFrames : 0)),
      mixed_(channels_ * kMaxFrames) {}

// The next block may take as many frames at once as the largest so far.
bool BlockMixer::wants_keyframe(double lead_s) const {
  if (published_ < 2) return true;
  const std::size_t waiting = queue_.size();
  if (waiting >= ahead_.load(std::memory_order_relaxed)) return false;
  const double left_frames =
      static_cast<double>(waiting) * kKeyframeFrames + frames_left_.load(std::memory_order_relaxed);
  return left_frames < block_frames_.load(std::memory_order_relaxed) + lead_s * kSampleRate_hz;
}

void BlockMixer::publish(const Keyframe& written) {
  if (published_ == 2) {
    queue_.publish();
    return;
  }
  if (published_++ == 0) {
    mixer_.begin(written, -mixer_.lead_frames());  // the limiter's delay makes no keyframe later
    return;
  }
  if (sounds_ != nullptr) sounds_->mark_quiescent(mixer_.clock_frames());
  mixer_.load(written);
  mix_lead();
  frames_left_.store(mixer_.frames_left(), std::memory_order_relaxed);
  begun_.store(true, std::memory_order_release);
}

// Mixes up to time 0; frames beyond are kept for the first block.
void BlockMixer::mix_lead() {
  static_assert(kHrtfDelayFrames + kLimiterDelayFrames < kKeyframeFrames);
  for (int left = lead_frames_; left > 0;) {
    mix_steps(std::min((left + kStepFrames - 1) / kStepFrames, mixer_.steps_left()));
    const int mixed = static_cast<int>(mixed_end_ / channels_);
    mixed_read_ = static_cast<std::size_t>(std::min(left, mixed)) * channels_;
    left -= mixed;
  }
  for (std::atomic<float>& peak : peak_) peak.store(0, std::memory_order_relaxed);
}

void BlockMixer::mix(std::span<float> interleaved) noexcept REALTIME {
  expect(interleaved.size() / channels_);
  bool held = false;
  if (!begun_.load(std::memory_order_acquire)) {
    std::fill(interleaved.begin(), interleaved.end(), 0.0f);
    held = true;
  } else {
    const double start_s = adapting_ ? clock_.now() : 0;
    std::size_t sounding = 0, frames = 0;
    for (std::size_t i = 0; i < interleaved.size();) {
      if (mixed_read_ == mixed_end_) {
        held = mix_more(interleaved.size() - i) || held;
        frames += mixed_end_ / channels_;
        sounding = std::max(sounding, mixer_.sounding());
      }
      const std::size_t count = std::min(interleaved.size() - i, mixed_end_ - mixed_read_);
      std::copy_n(mixed_.begin() + static_cast<std::ptrdiff_t>(mixed_read_), count,
                  interleaved.begin() + static_cast<std::ptrdiff_t>(i));
      mixed_read_ += count;
      i += count;
    }
    frames_left_.store(mixer_.frames_left(), std::memory_order_relaxed);
    if (adapting_ && frames > 0) tell_load(clock_.now() - start_s, frames, sounding);
  }
  if (held) held_blocks_.fetch_add(1, std::memory_order_relaxed);
}

// Records a block size. If it is the largest so far, keyframes are made further ahead from now on.
void BlockMixer::expect(std::size_t frames) noexcept REALTIME {
  if (frames <= largest_block_frames_) return;
  largest_block_frames_ = frames;
  const auto fits = static_cast<int>(std::min<std::size_t>(frames, kLargestUnexpected_frames));
  ahead_.store(std::max(ahead_.load(std::memory_order_relaxed), keyframes_ahead(fits)),
               std::memory_order_relaxed);
  block_frames_.store(std::max(block_frames_.load(std::memory_order_relaxed), fits),
                      std::memory_order_relaxed);
}

// Mixes steps for up to `samples` samples. Returns true if a due keyframe was missing.
bool BlockMixer::mix_more(std::size_t samples) noexcept REALTIME {
  bool held = false;
  if (turns_) mixer_.turn_head(axes_.latest());
  const Keyframe* const keyframe = mixer_.wants_keyframe() ? queue_.readable() : nullptr;
  if (adapting_ && keyframe != nullptr) load_.expect(keyframe->voices.size());
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
  const std::size_t step = channels_ * kStepFrames;
  const auto steps =
      static_cast<int>(std::min<std::size_t>((samples + step - 1) / step, mixer_.steps_left()));
  mix_steps(steps);
  if (mixer_.holds())
    held_frames_.fetch_add(static_cast<std::uint64_t>(steps) * kStepFrames,
                           std::memory_order_relaxed);
  return held;
}

void BlockMixer::mix_steps(int steps) noexcept REALTIME {
  mixer_.mix(mixed_.data(), steps);
  mixed_end_ = static_cast<std::size_t>(steps) * channels_ * kStepFrames;
  mixed_read_ = 0;
  finish_mix();
}

// Reports how long mixing took.
void BlockMixer::tell_load(double took_s, std::size_t frames,
                           std::size_t sounding) noexcept REALTIME {
  load_.mixed(took_s, static_cast<double>(frames) / kSampleRate_hz, sounding);
  const auto now_shed = static_cast<std::uint32_t>(mixer_.shed());
  loaded_.store(static_cast<std::uint32_t>(mixer_.voices()), std::memory_order_relaxed);
  shed_.store(now_shed, std::memory_order_relaxed);
  if (now_shed > max_shed_voices_.load(std::memory_order_relaxed))
    max_shed_voices_.store(now_shed, std::memory_order_relaxed);
  if (now_shed > 0) shedding_blocks_.fetch_add(1, std::memory_order_relaxed);
  mixer_is_full_.store(load_.is_full(mixer_.voices()), std::memory_order_relaxed);
}

// Applies the output gain and the limiter, and updates peaks and statistics.
void BlockMixer::finish_mix() noexcept REALTIME {
  for (std::size_t i = 0; i < mixed_end_; ++i) mixed_[i] *= gain_;
  if (limiter_ != nullptr) limiter_->process(std::span(mixed_).first(mixed_end_));
  std::array<float, kMaxChannels> highest{};
  std::uint64_t clipped = 0;
  for (std::size_t f = 0; f < mixed_end_; f += channels_) {
    bool clips = false;
    for (std::size_t c = 0; c < channels_; ++c) {
      const float sample = mixed_[f + c];
      highest[c] = std::max(highest[c], std::abs(sample));
      clips = clips || std::abs(sample) > 1;
    }
    clipped += clips;
  }
  for (std::size_t c = 0; c < channels_; ++c)
    if (highest[c] > peak_[c].load(std::memory_order_relaxed))
      peak_[c].store(highest[c], std::memory_order_relaxed);
  clipped_frames_.fetch_add(clipped, std::memory_order_relaxed);
  bad_voices_.store(mixer_.bad_voices(), std::memory_order_relaxed);
  late_voices_.store(mixer_.late_voices(), std::memory_order_relaxed);
}

double BlockMixer::shed_share() const {
  const double of = loaded_.load(std::memory_order_relaxed);
  return of > 0 ? shed_.load(std::memory_order_relaxed) / of : 0;
}

BlockStatistics BlockMixer::statistics() {
  BlockStatistics now{.held_blocks = held_blocks_.load(std::memory_order_relaxed),
                      .clipped_frames = clipped_frames_.load(std::memory_order_relaxed),
                      .bad_voices = bad_voices_.load(std::memory_order_relaxed),
                      .late_voices = late_voices_.load(std::memory_order_relaxed),
                      .shed_voices = shed_.load(std::memory_order_relaxed),
                      .max_shed_voices = max_shed_voices_.load(std::memory_order_relaxed),
                      .shedding_blocks = shedding_blocks_.load(std::memory_order_relaxed)};
  if (limiter_ != nullptr) now.limited = limiter_->worked();
  for (std::size_t c = 0; c < channels_; ++c)
    now.peak[c] = peak_[c].exchange(0, std::memory_order_relaxed);
  return now;
}

}  // namespace clamor
