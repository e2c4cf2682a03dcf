#include "runtime/auralizer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "runtime/keyframe_maker.h"
#include "runtime/keyframe_queue.h"
#include "runtime/loudness.h"
#include "runtime/mixer.h"
#include "runtime/moving_list.h"
#include "runtime/octree_pool.h"
#include "runtime/sampler.h"
#include "runtime/sight_geometry.h"
#include "runtime/signal_bank.h"
#include "runtime/source_field.h"
#include "runtime/strategies.h"
#include "runtime/visibility_cache.h"

namespace clamor {

namespace {

constexpr int kLargestBlock_frames = 1 << 16;

// A device may ask for larger blocks than it was expected to, or change them: there is room for
// keyframes as far ahead as for these, and they are made as far ahead as it takes.
constexpr int kLargestUnexpected_frames = 4096;

// Two segments beyond the longest block: the one being mixed and the one that may end within it.
std::size_t keyframes_ahead(int block_frames, bool limit) noexcept REALTIME {
  block_frames += limit ? kLimiterDelayFrames : 0;
  return 2 + static_cast<std::size_t>((block_frames + kKeyframeFrames - 1) / kKeyframeFrames);
}

std::size_t keyframes_ahead(const AuralizerOptions& options) {
  return keyframes_ahead(options.block_frames, options.limit);
}

std::size_t most_keyframes_ahead(const AuralizerOptions& options) {
  return keyframes_ahead(std::max(options.block_frames, kLargestUnexpected_frames), options.limit);
}

// Voices that fade out count too; three samples' worth is full only when the listener jumps about.
std::size_t slots_for(const Sampler& sampler) { return 3 * sampler.capacity(); }

StrategyOptions strategy_of(const AuralizerOptions& options) {
  return {options.strategy, static_cast<std::size_t>(std::max(options.voices, 0)),
          options.estimator, options.tuning};
}

Error nothing_to_hear() {
  return Error("there are no sources to hear; bake the level with an emitter.");
}

bool looks(const AuralizerOptions& options) {
  return options.visibility && asks_what_hides(options.strategy);
}

SignalWeights weights_of(const AuralizerInput& input) {
  if (!input.envelopes.empty()) return make_signal_weights(input.envelopes);
  std::vector<TimedEnvelope> envelopes;
  for (const Signal& signal : input.signals)
    envelopes.push_back({SignalEnvelope(signal), signal.samples.size(), signal.loop});
  return make_signal_weights(envelopes);
}

// Panned voices have one delay, binaural ones two.
MixMode mode_of(const Panner* panner, const Head* head) {
  MixMode mode;
  mode.head = head != nullptr;
  if (panner == nullptr) return mode;
  mode.delays = 1;
  mode.pairs = panner->channels() / kEars;
  return mode;
}

// One of a signal's blocks, as a file would have it.
std::vector<float> block_of(const Signal& signal, std::size_t block) {
  const SignalBlock where = signal_block(signal.samples.size(), block);
  const auto first = signal.samples.begin() + static_cast<std::ptrdiff_t>(where.first);
  return {first, first + static_cast<std::ptrdiff_t>(where.frames)};
}

// Sounds as voices want them: a file's, and then the input's own. Both must outlive what comes out.
std::unique_ptr<SoundLoader> sounds_from(const BakeFile& file, const AuralizerInput& input,
                                         const MixMode& mode, const AuralizerOptions& options) {
  std::vector<SignalShape> shapes;
  for (const TimedEnvelope& signal : input.envelopes)
    shapes.push_back({signal.frames, signal.loop, signal.envelope.mean_square()});
  const std::uint64_t bytes = std::min(SoundLoader::bytes_of(shapes, mode),
                                       std::max(options.memory_bytes / 2, kLeastSounds_bytes));
  return std::make_unique<SoundLoader>(
      shapes, file.emitters(), mode,
      [&file, &input](std::size_t signal, std::size_t block) -> Result<std::vector<float>> {
        if (signal < file.signal_count()) return file.read_signal_block(signal, block);
        return block_of(input.signals[signal - file.signal_count()], block);
      },
      SoundBudget{bytes, !options.wait_for_pages}, most_keyframes_ahead(options),
      std::clamp(static_cast<int>(std::thread::hardware_concurrency()) / 2, 1, 4));
}

}  // namespace

struct Auralizer::State {
  // From a file, or from the input's sources where there is none.
  State(AuralizerInput&& from, std::shared_ptr<const BakeFile> opened,
        const AuralizerOptions& options)
      : input(std::move(from)),
        file(std::move(opened)),
        ahead(keyframes_ahead(options)),
        gain(static_cast<float>(options.gain)),
        wait_for_pages(options.wait_for_pages),
        first_sounds_end_s(LoadClock::steady_s(nullptr) + options.first_sounds_s),
        panner(options.output.make_panner()),
        head(options.output.head),
        mode(mode_of(panner.get(), head.get())),
        channels(static_cast<std::size_t>(kEars * mode.pairs)),
        sounds(file == nullptr ? nullptr : sounds_from(*file, input, mode, options)),
        decoded(file == nullptr ? prepare_signals(input.signals, mode)
                                : std::vector<PreparedSignal>()),
        signals(file == nullptr ? decoded : sounds->signals()),
        field(input.emitters, input.materials, input.air, LateBoost(input.decay)),
        weights(needs_list(options.strategy) ? mean_weights(signals) : weights_of(input)),
        ceilings(file == nullptr ? weights : highest_over_copies(weights, file->signal_maps())) {
    const StrategyOptions strategy = strategy_of(options);
    look_for_what_hides(options);
    if (file != nullptr) {
      loader = std::make_unique<PageLoader>(
          pages_of(*file, field, ceilings),
          PageBudget{
              options.memory_bytes - std::min(sounds->budget_bytes(), options.memory_bytes / 2),
              !options.wait_for_pages});
      pool = std::make_unique<OctreePool>(field, ceilings, file->trees(), file->signal_maps(),
                                          *loader);
      join_moving(options.moving);
      sampler = make_sampler(strategy, field, weights, sampled_pool(), sight.get());
    } else {
      auto list = std::make_unique<SourceList>(field, weights, std::move(input.sources));
      SourceList& listed = *list;
      pool = std::move(list);
      join_moving(options.moving);
      sampler = needs_list(options.strategy)
                    ? make_sampler(strategy, field, weights, listed, sight.get(), movers.get())
                    : make_sampler(strategy, field, weights, sampled_pool(), sight.get());
    }
    const std::size_t slots = slots_for(*sampler);
    maker = std::make_unique<KeyframeMaker>(field, slots,
                                            panner == nullptr && head == nullptr
                                                ? KeyframeMaker::Receivers::kPair
                                                : KeyframeMaker::Receivers::kOne,
                                            head);
    queue = std::make_unique<KeyframeQueue>(most_keyframes_ahead(options), slots);
    mixer = std::make_unique<Mixer>(signals, slots, mode, panner.get(), head.get());
    mixed.resize(channels * kMostFrames);
    script = options.script;
    adapting = options.adapt;
    sampler_clock = options.sampler_clock;
    audio_clock = options.audio_clock;
    limit_of_k.emplace(sampler->capacity());
    if (options.limit) limiter = std::make_unique<Limiter>(channels);
  }

  void look_for_what_hides(const AuralizerOptions& options) {
    if (!looks(options) || input.mesh.triangles.empty()) return;
    using Ready = SightGeometry::Ready;
    surfaces = std::make_unique<SightGeometry>(
        input.mesh, input.materials, options.wait_for_pages ? Ready::kWhole : Ready::kSoon);
    sight = std::make_unique<VisibilityCache>(
        *surfaces, field.speed_of_sound_mps(),
        VisibilityOptions{.rays_per_keyframe = options.rays, .exact = options.wait_for_pages});
  }

  // Those that move, in one ranking with the others.
  void join_moving(const MovingOptions& options) {
    if (options.most == 0) return;
    moving = std::make_unique<MovingSources>(options.most, options.kinds.size());
    movers = std::make_unique<MovingList>(*moving, field, weights.by_signal, input.emitters,
                                          options.kinds.size());
    joined = std::make_unique<JoinedPool>(*pool, *movers);
  }
  SourcePool& sampled_pool() { return joined != nullptr ? *joined : *pool; }

  AuralizerInput input;
  const std::shared_ptr<const BakeFile> file;
  std::atomic<std::size_t> ahead;  // keyframes that may wait for the mixer
  const float gain;
  const bool wait_for_pages;
  const double first_sounds_end_s;
  const std::unique_ptr<const Panner> panner;
  const std::shared_ptr<const Head> head;
  const MixMode mode;
  const std::size_t channels;
  const std::unique_ptr<SoundLoader> sounds;  // of a file; otherwise they are
  const std::vector<PreparedSignal> decoded;  // already
  const std::span<const PreparedSignal> signals;
  const SourceField field;
  const SignalWeights weights, ceilings;

  // Sampler thread.
  std::unique_ptr<SightGeometry> surfaces;
  std::unique_ptr<VisibilityCache> sight;
  std::unique_ptr<PageLoader> loader;
  std::unique_ptr<SourcePool> pool;
  std::unique_ptr<MovingSources> moving;  // the caller's too, unless there is a script
  std::shared_ptr<MovingScript> script;
  std::unique_ptr<MovingList> movers;
  std::unique_ptr<SourcePool> joined;  // pool and movers
  std::unique_ptr<Sampler> sampler;
  std::unique_ptr<KeyframeMaker> maker;
  std::uint64_t made = 0;
  bool adapting = false;
  LoadClock sampler_clock, audio_clock;
  std::optional<VoiceLimit> limit_of_k;

  std::unique_ptr<KeyframeQueue> queue;
  std::atomic<bool> begun{false};  // keyframe 0 is in the mixer, which is now the audio thread's

  // Audio thread.
  std::unique_ptr<Mixer> mixer;
  std::size_t largest_block_frames = 0;
  BlockLoad block_load;
  std::unique_ptr<Limiter> limiter;        // or null
  int limiter_lead = kLimiterDelayFrames;  // frames to drop until it gives what it was given
  std::vector<float> mixed;
  std::size_t mixed_end = 0, mixed_read = 0;  // samples in it, and those already given away

  // Statistics.
  std::atomic<std::uint64_t> keyframes{0}, held_blocks{0}, clipped_frames{0}, bad_voices{0};
  std::atomic<std::uint64_t> late_voices{0};
  std::atomic<std::uint64_t> rays{0}, late_sources{0};
  std::atomic<std::uint32_t> voices{0};
  std::atomic<std::uint32_t> loaded{0}, shed{0}, most_shed{0};  // of the mixer's voices
  std::atomic<bool> mixer_is_full{false};
  std::atomic<std::uint64_t> shedding_blocks{0}, late_keyframes{0};
  std::atomic<std::uint32_t> k{0}, least_k{0};
  std::atomic<double> sampler_ms{0};
  std::array<std::atomic<float>, kMostChannels> peak{};

  // From the first block on that is larger than expected, keyframes are made as far ahead.
  void expect(std::size_t frames) noexcept REALTIME {
    if (frames <= largest_block_frames) return;
    largest_block_frames = frames;
    const auto fits = static_cast<int>(std::min<std::size_t>(frames, kLargestUnexpected_frames));
    ahead.store(
        std::max(ahead.load(std::memory_order_relaxed), keyframes_ahead(fits, limiter != nullptr)),
        std::memory_order_relaxed);
  }

  // Sees to it that what the keyframe plays is decoded; the first waits for it.
  void play(const Keyframe& keyframe) {
    if (sounds == nullptr) return;
    sounds->play(keyframe.voices);
    if (wait_for_pages)
      sounds->wait(std::numeric_limits<double>::infinity());
    else if (made == 0)
      sounds->wait(std::max(0.0, first_sounds_end_s - LoadClock::steady_s(nullptr)));
  }

  // Mixes steps for up to so many samples; true if it had to do without a keyframe that was due.
  bool mix_steps(std::size_t samples) noexcept REALTIME {
    bool held = false;
    const Keyframe* const keyframe = mixer->wants_keyframe() ? queue->readable() : nullptr;
    if (adapting && keyframe != nullptr) block_load.expect(keyframe->voices.size());
    mixer->allow(block_load.allowed());
    if (mixer->wants_keyframe()) {
      if (sounds != nullptr) sounds->pass(mixer->clock_frames());
      if (keyframe != nullptr) {
        mixer->load(*keyframe);
        queue->release();
      } else {
        mixer->hold();
        held = true;
      }
    }
    const std::size_t step = channels * kStepFrames;
    const int steps =
        static_cast<int>(std::min<std::size_t>((samples + step - 1) / step, mixer->steps_left()));
    mixer->mix(mixed.data(), steps);
    mixed_end = static_cast<std::size_t>(steps) * step;
    mixed_read = 0;
    finish_mix();
    drop_lead();
    return held;
  }

  // What mixing those frames took, for the next ones.
  void tell_load(double took_s, std::size_t frames, std::size_t sounding) noexcept REALTIME {
    block_load.mixed(took_s, static_cast<double>(frames) / kSampleRate_hz, sounding);
    const auto now_shed = static_cast<std::uint32_t>(mixer->left_out());
    loaded.store(static_cast<std::uint32_t>(mixer->voices()), std::memory_order_relaxed);
    shed.store(now_shed, std::memory_order_relaxed);
    if (now_shed > most_shed.load(std::memory_order_relaxed))
      most_shed.store(now_shed, std::memory_order_relaxed);
    if (now_shed > 0) shedding_blocks.fetch_add(1, std::memory_order_relaxed);
    const double nearly = 1.02 * static_cast<double>(mixer->voices());
    mixer_is_full.store(static_cast<double>(block_load.allowed()) < nearly,
                        std::memory_order_relaxed);
  }

  // Sampler thread: how many sources to choose, after a keyframe took so long.
  void adapt_k(double took_s) {
    const double of = loaded.load(std::memory_order_relaxed);
    const double left_out = of > 0 ? shed.load(std::memory_order_relaxed) / of : 0;
    limit_of_k->keyframe_took(took_s * kSampleRate_hz / kKeyframeFrames, left_out,
                              mixer_is_full.load(std::memory_order_relaxed));
    sampler->choose_at_most(limit_of_k->voices());
    late_keyframes.store(limit_of_k->late(), std::memory_order_relaxed);
  }

  // The limiter holds frames back: by as much its first ones are nobody's, and the mixer is ahead.
  void drop_lead() noexcept REALTIME {
    if (limiter == nullptr || limiter_lead == 0) return;
    const auto frames = static_cast<int>(mixed_end / channels);
    const int dropped = std::min(limiter_lead, frames);
    limiter_lead -= dropped;
    mixed_read = static_cast<std::size_t>(dropped) * channels;
  }

  // Applies the output gain, limits it and looks for what a listener should know of.
  void finish_mix() noexcept REALTIME {
    for (std::size_t i = 0; i < mixed_end; ++i) mixed[i] *= gain;
    if (limiter != nullptr) limiter->process(std::span(mixed).first(mixed_end));
    std::array<float, kMostChannels> highest{};
    std::uint64_t clipped = 0;
    for (std::size_t f = 0; f < mixed_end; f += channels) {
      bool clips = false;
      for (std::size_t c = 0; c < channels; ++c) {
        const float sample = mixed[f + c];
        highest[c] = std::max(highest[c], std::abs(sample));
        clips = clips || std::abs(sample) > 1;
      }
      clipped += clips;
    }
    for (std::size_t c = 0; c < channels; ++c)
      if (highest[c] > peak[c].load(std::memory_order_relaxed))
        peak[c].store(highest[c], std::memory_order_relaxed);
    clipped_frames.fetch_add(clipped, std::memory_order_relaxed);
    bad_voices.store(mixer->bad_voices(), std::memory_order_relaxed);
    late_voices.store(mixer->late_voices(), std::memory_order_relaxed);
  }
};

Auralizer::Auralizer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Auralizer::~Auralizer() = default;

Result<void> Auralizer::check(const AuralizerOptions& options) {
  if (options.voices < 1)
    return Error("cannot mix " + std::to_string(options.voices) + " voices; ask for 1 or more.");
  if (const auto right = clamor::check(strategy_of(options)); !right.ok()) return right;
  if (options.rays < 1)
    return Error("cannot look for what hides sources with " + std::to_string(options.rays) +
                 " rays a keyframe; ask for 1 or more, or for no visibility.");
  if (!std::isfinite(options.gain) || options.gain < 0)
    return Error("the output gain must be a finite amplitude, 0 or more; 1 leaves it as it is.");
  if (options.block_frames < 1 || options.block_frames > kLargestBlock_frames)
    return Error("cannot mix blocks of " + std::to_string(options.block_frames) +
                 " frames; ask for 1 to " + std::to_string(kLargestBlock_frames) + ".");
  if (options.moving.most > kMostMovingSources)
    return Error("there may be at most " + std::to_string(kMostMovingSources) +
                 " moving sources at a time.");
  if (options.moving.most > 0 && !takes_moving(options.strategy))
    return Error("the strategy " + in_quotes(options.strategy) +
                 " knows nothing of moving sources; take 'priority' or 'all'.");
  return {};
}

Result<std::unique_ptr<Auralizer>> Auralizer::create(AuralizerInput input,
                                                     const AuralizerOptions& options) {
  if (const auto right = check(options); !right.ok()) return right.error();
  if (const auto right = clamor::check(input); !right.ok()) return right.error();
  if (input.sources.empty() && options.moving.most == 0) return nothing_to_hear();
  if (const auto added = add_kinds(options.moving, input); !added.ok()) return added.error();
  return std::unique_ptr<Auralizer>(
      new Auralizer(std::make_unique<State>(std::move(input), nullptr, options)));
}

Result<std::unique_ptr<Auralizer>> Auralizer::create(std::shared_ptr<const BakeFile> file,
                                                     const AuralizerOptions& options) {
  if (const auto right = check(options); !right.ok()) return right.error();
  const bool listed = needs_list(options.strategy);
  auto input = listed ? read_auralizer_input(*file) : read_tables(*file);
  if (!input.ok()) return input.error();
  if (looks(options))
    if (const auto read = read_what_hides(*file, *input); !read.ok()) return read.error();
  if (listed) {
    auto auralizer = create(std::move(*input), options);
    if (!auralizer.ok()) return auralizer.error().in(file->path());
    return auralizer;
  }
  if (file->source_count() == 0 && options.moving.most == 0)
    return nothing_to_hear().in(file->path());
  if (const auto added = add_kinds(options.moving, *input); !added.ok())
    return added.error().in(file->path());
  auto state = std::make_unique<State>(std::move(*input), file, options);
  if (const PageStatistics pages = state->loader->statistics(); pages.failed > 0)
    return Error(pages.failure);
  return std::unique_ptr<Auralizer>(new Auralizer(std::move(state)));
}

bool Auralizer::wants_keyframe() const {
  // Keyframe 0 goes to the mixer without queueing.
  return state_->made == 0 || state_->queue->size() < state_->ahead.load(std::memory_order_relaxed);
}

double Auralizer::next_keyframe_time_s() const {
  return static_cast<double>(state_->made) * kKeyframeFrames / kSampleRate_hz;
}

void Auralizer::make_keyframe(const Pose& pose) {
  State& state = *state_;
  Keyframe* const keyframe = state.queue->writable();
  if (keyframe == nullptr) return;
  const double start_s = state.sampler_clock.now();
  const double time_s = next_keyframe_time_s();
  if (state.script != nullptr) (void)state.script->apply(*state.moving, time_s);  // its own sources
  auto sample = state.sampler->sample(pose.position_m, time_s);
  while (state.wait_for_pages && !state.sampler->complete())
    sample = state.sampler->sample(pose.position_m, time_s);
  state.maker->make(sample, pose, *keyframe);
  state.play(*keyframe);
  if (state.surfaces != nullptr) state.surfaces->improve();
  const double took_s = state.sampler_clock.now() - start_s;
  if (state.adapting && state.made > 0) state.adapt_k(took_s);

  state.voices.store(static_cast<std::uint32_t>(keyframe->voices.size()),
                     std::memory_order_relaxed);
  state.sampler_ms.store(1e3 * took_s, std::memory_order_relaxed);
  state.k.store(static_cast<std::uint32_t>(state.limit_of_k->voices()), std::memory_order_relaxed);
  state.least_k.store(static_cast<std::uint32_t>(state.limit_of_k->least_so_far()),
                      std::memory_order_relaxed);
  if (state.sight != nullptr) {
    state.rays.store(state.sight->statistics().rays, std::memory_order_relaxed);
    state.late_sources.store(state.sight->statistics().late, std::memory_order_relaxed);
  }
  state.keyframes.fetch_add(1, std::memory_order_relaxed);
  if (state.made++ == 0) {
    state.mixer->begin(*keyframe, 0);
    state.begun.store(true, std::memory_order_release);
  } else {
    state.queue->publish();
  }
}

void Auralizer::mix(std::span<float> interleaved) noexcept REALTIME {
  State& state = *state_;
  state.expect(interleaved.size() / state.channels);
  bool held = false;
  if (!state.begun.load(std::memory_order_acquire)) {
    std::fill(interleaved.begin(), interleaved.end(), 0.0f);
    held = true;
  } else {
    const double start_s = state.adapting ? state.audio_clock.now() : 0;
    std::size_t sounding = 0, frames = 0;
    for (std::size_t i = 0; i < interleaved.size();) {
      if (state.mixed_read == state.mixed_end) {
        held = state.mix_steps(interleaved.size() - i) || held;
        frames += state.mixed_end / state.channels;
        sounding = std::max(sounding, state.mixer->sounding());
      }
      const std::size_t count =
          std::min(interleaved.size() - i, state.mixed_end - state.mixed_read);
      std::copy_n(state.mixed.begin() + static_cast<std::ptrdiff_t>(state.mixed_read), count,
                  interleaved.begin() + static_cast<std::ptrdiff_t>(i));
      state.mixed_read += count;
      i += count;
    }
    if (state.adapting && frames > 0)
      state.tell_load(state.audio_clock.now() - start_s, frames, sounding);
  }
  if (held) state.held_blocks.fetch_add(1, std::memory_order_relaxed);
}

MovingSources* Auralizer::moving() {
  return state_->script == nullptr ? state_->moving.get() : nullptr;
}

int Auralizer::channels() const noexcept REALTIME { return static_cast<int>(state_->channels); }

AuralizerStatistics Auralizer::statistics() {
  AuralizerStatistics statistics;
  statistics.keyframes = state_->keyframes.load(std::memory_order_relaxed);
  statistics.held_blocks = state_->held_blocks.load(std::memory_order_relaxed);
  statistics.voices = state_->voices.load(std::memory_order_relaxed);
  statistics.sampler_ms = state_->sampler_ms.load(std::memory_order_relaxed);
  for (std::size_t c = 0; c < state_->channels; ++c)
    statistics.peak[c] = state_->peak[c].exchange(0, std::memory_order_relaxed);
  statistics.clipped_frames = state_->clipped_frames.load(std::memory_order_relaxed);
  statistics.bad_voices = state_->bad_voices.load(std::memory_order_relaxed);
  if (state_->limiter != nullptr) statistics.limited = state_->limiter->worked();
  statistics.rays = state_->rays.load(std::memory_order_relaxed);
  statistics.k = state_->k.load(std::memory_order_relaxed);
  statistics.least_k = state_->least_k.load(std::memory_order_relaxed);
  statistics.most_k = static_cast<std::uint32_t>(state_->sampler->capacity());
  statistics.late_keyframes = state_->late_keyframes.load(std::memory_order_relaxed);
  statistics.shed_voices = state_->shed.load(std::memory_order_relaxed);
  statistics.most_shed = state_->most_shed.load(std::memory_order_relaxed);
  statistics.shedding_blocks = state_->shedding_blocks.load(std::memory_order_relaxed);
  statistics.late_sources = state_->late_sources.load(std::memory_order_relaxed);
  if (state_->loader != nullptr) statistics.pages = state_->loader->statistics();
  if (state_->sounds != nullptr) statistics.sounds = state_->sounds->statistics();
  statistics.sounds.late = state_->late_voices.load(std::memory_order_relaxed);
  return statistics;
}

}  // namespace clamor
