#include "runtime/auralizer.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "runtime/keyframe_maker.h"
#include "runtime/keyframe_queue.h"
#include "runtime/loudness.h"
#include "runtime/mixer.h"
#include "runtime/sampler.h"
#include "runtime/signal_bank.h"
#include "runtime/source_field.h"

namespace clamor {

namespace {

constexpr int kLargestBlock_frames = 1 << 16;

// Two segments beyond the longest block: the one being mixed and the one that may end within it.
std::size_t keyframes_ahead(int block_frames) {
  return 2 + static_cast<std::size_t>((block_frames + kKeyframeFrames - 1) / kKeyframeFrames);
}

// Voices that fade out count too; three samples' worth is full only when the listener jumps about.
std::size_t slots_for(const Sampler& sampler) { return 3 * sampler.capacity(); }

SignalWeights weights_of(const std::vector<PreparedSignal>& signals) {
  const Bands loudness = loudness_weights();
  SignalWeights weights;
  for (const PreparedSignal& signal : signals) {
    Bands& weight = weights.by_signal.emplace_back();
    for (std::size_t b = 0; b < kBandCount; ++b) weight[b] = loudness[b] * signal.mean_square()[b];
  }
  return weights;
}

std::vector<float> permanent_numbers(const std::vector<Source>& sources) {
  std::vector<float> u;
  u.reserve(sources.size());
  for (const Source& source : sources) u.push_back(source.u);
  return u;
}

}  // namespace

struct Auralizer::State {
  State(AuralizerInput&& from, const AuralizerOptions& options)
      : input(std::move(from)),
        gain(static_cast<float>(options.gain)),
        signals(prepare_signals(input.signals)),
        field(input),
        sampler(make_sampler(options.strategy, field, weights_of(signals),
                             permanent_numbers(input.sources),
                             static_cast<std::size_t>(options.voices))),
        maker(field, slots_for(*sampler)),
        queue(keyframes_ahead(options.block_frames), slots_for(*sampler)),
        mixer(signals, slots_for(*sampler)) {}

  const AuralizerInput input;
  const float gain;
  const std::vector<PreparedSignal> signals;
  const SourceField field;

  // Sampler thread.
  const std::unique_ptr<Sampler> sampler;
  KeyframeMaker maker;
  std::uint64_t made = 0;

  KeyframeQueue queue;
  std::atomic<bool> begun{false};  // keyframe 0 is in the mixer, which is now the audio thread's

  // Audio thread.
  Mixer mixer;
  std::array<float, kOutputChannels * kStepFrames> step{};
  std::size_t step_read = step.size();  // samples of the step already given away

  // Statistics.
  std::atomic<std::uint64_t> keyframes{0}, held_blocks{0}, clipped_frames{0}, bad_voices{0};
  std::atomic<std::uint32_t> voices{0};
  std::atomic<double> sampler_ms{0};
  std::array<std::atomic<float>, kOutputChannels> peak{};

  // True if the step had to do without a keyframe that was due.
  bool mix_step() noexcept REALTIME {
    bool held = false;
    if (mixer.wants_keyframe()) {
      if (const Keyframe* keyframe = queue.readable()) {
        mixer.load(*keyframe);
        queue.release();
      } else {
        mixer.hold();
        held = true;
      }
    }
    mixer.step(step.data());
    finish_step();
    step_read = 0;
    return held;
  }

  // Applies the output gain and looks for what a listener should know of.
  void finish_step() noexcept REALTIME {
    std::array<float, kOutputChannels> highest{};
    std::uint64_t clipped = 0;
    for (std::size_t f = 0; f < step.size(); f += kOutputChannels) {
      bool clips = false;
      for (std::size_t c = 0; c < kOutputChannels; ++c) {
        float& sample = step[f + c];
        sample *= gain;
        highest[c] = std::max(highest[c], std::abs(sample));
        clips = clips || std::abs(sample) > 1;
      }
      clipped += clips;
    }
    for (std::size_t c = 0; c < kOutputChannels; ++c)
      if (highest[c] > peak[c].load(std::memory_order_relaxed))
        peak[c].store(highest[c], std::memory_order_relaxed);
    clipped_frames.fetch_add(clipped, std::memory_order_relaxed);
    bad_voices.store(mixer.bad_voices(), std::memory_order_relaxed);
  }
};

Auralizer::Auralizer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Auralizer::~Auralizer() = default;

Result<std::unique_ptr<Auralizer>> Auralizer::create(AuralizerInput input,
                                                     const AuralizerOptions& options) {
  if (options.strategy != "all" && options.strategy != "priority")
    return Error("no strategy is called " + in_quotes(options.strategy) +
                 "; there are 'priority' and 'all'.");
  if (options.voices < 1)
    return Error("cannot mix " + std::to_string(options.voices) + " voices; ask for 1 or more.");
  if (!std::isfinite(options.gain) || options.gain < 0)
    return Error("the output gain must be a finite amplitude, 0 or more; 1 leaves it as it is.");
  if (options.block_frames < 1 || options.block_frames > kLargestBlock_frames)
    return Error("cannot mix blocks of " + std::to_string(options.block_frames) +
                 " frames; ask for 1 to " + std::to_string(kLargestBlock_frames) + ".");
  if (const Result<void> checked = check(input); !checked.ok()) return checked.error();
  return std::unique_ptr<Auralizer>(
      new Auralizer(std::make_unique<State>(std::move(input), options)));
}

bool Auralizer::wants_keyframe() const {
  // Keyframe 0 goes to the mixer without queueing.
  return state_->made == 0 || state_->queue.writable() != nullptr;
}

double Auralizer::next_keyframe_time_s() const {
  return static_cast<double>(state_->made) * kKeyframeFrames / kSampleRate_hz;
}

void Auralizer::make_keyframe(const Pose& pose) {
  State& state = *state_;
  Keyframe* const keyframe = state.queue.writable();
  if (keyframe == nullptr) return;
  const auto start = std::chrono::steady_clock::now();
  state.maker.make(state.sampler->sample(pose.position_m), pose, *keyframe);
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;

  state.voices.store(static_cast<std::uint32_t>(keyframe->voices.size()),
                     std::memory_order_relaxed);
  state.sampler_ms.store(took.count(), std::memory_order_relaxed);
  state.keyframes.fetch_add(1, std::memory_order_relaxed);
  if (state.made++ == 0) {
    state.mixer.begin(*keyframe, 0);
    state.begun.store(true, std::memory_order_release);
  } else {
    state.queue.publish();
  }
}

void Auralizer::mix(std::span<float> interleaved) noexcept REALTIME {
  State& state = *state_;
  bool held = false;
  if (!state.begun.load(std::memory_order_acquire)) {
    std::fill(interleaved.begin(), interleaved.end(), 0.0f);
    held = true;
  } else {
    for (std::size_t i = 0; i < interleaved.size();) {
      if (state.step_read == state.step.size()) held = state.mix_step() || held;
      const std::size_t count =
          std::min(interleaved.size() - i, state.step.size() - state.step_read);
      std::copy_n(state.step.begin() + static_cast<std::ptrdiff_t>(state.step_read), count,
                  interleaved.begin() + static_cast<std::ptrdiff_t>(i));
      state.step_read += count;
      i += count;
    }
  }
  if (held) state.held_blocks.fetch_add(1, std::memory_order_relaxed);
}

AuralizerStatistics Auralizer::statistics() {
  AuralizerStatistics statistics;
  statistics.keyframes = state_->keyframes.load(std::memory_order_relaxed);
  statistics.held_blocks = state_->held_blocks.load(std::memory_order_relaxed);
  statistics.voices = state_->voices.load(std::memory_order_relaxed);
  statistics.sampler_ms = state_->sampler_ms.load(std::memory_order_relaxed);
  for (std::size_t c = 0; c < kOutputChannels; ++c)
    statistics.peak[c] = state_->peak[c].exchange(0, std::memory_order_relaxed);
  statistics.clipped_frames = state_->clipped_frames.load(std::memory_order_relaxed);
  statistics.bad_voices = state_->bad_voices.load(std::memory_order_relaxed);
  return statistics;
}

}  // namespace clamor
