#include "runtime/engine/auralizer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "runtime/engine/auralizer_statistics.h"
#include "runtime/engine/sampling_pipeline.h"
#include "runtime/mixing/block_mixer.h"
#include "runtime/mixing/head_rotation.h"
#include "runtime/mixing/keyframe_lead.h"
#include "runtime/propagation/loudness.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/streaming/prepared_signal.h"

namespace clamor {

namespace {

// At first everything is new to a crowd: pages come, and what hides them is looked for. That
// passes.
constexpr std::uint64_t kKeyframesToSettle = 50;

// Voices that fade out count too; three samples' worth is full only when the listener jumps about.
std::size_t slots_for(const Sampler& sampler) { return 3 * sampler.capacity(); }

Error nothing_to_hear() {
  return Error("there are no sources to hear; bake the level with an emitter.");
}

constexpr std::size_t kMaxKeyframesPerSample = kFadeKeyframes;

std::size_t keyframes_of_a_choice(std::size_t voices) {
  return std::clamp<std::size_t>(
      (voices + kVoicesPerKeyframeOfSample - 1) / kVoicesPerKeyframeOfSample, 1,
      kMaxKeyframesPerSample);
}

// Who is chosen less often must be chosen earlier, to have faded in when its sound begins.
SignalWeights weights_of(const AuralizerInput& input, int voices) {
  EnvelopeSmoothing smoothing;
  const std::size_t later = keyframes_of_a_choice(static_cast<std::size_t>(voices)) - 1;
  smoothing.around_s += static_cast<double>(later) * kKeyframeFrames / kSampleRate_hz;
  if (!input.envelopes.empty()) return make_signal_weights(input.envelopes, smoothing);
  std::vector<TimedEnvelope> envelopes;
  for (const Signal& signal : input.signals)
    envelopes.push_back({SignalEnvelope(signal), signal.samples.size(), signal.loop});
  return make_signal_weights(envelopes, smoothing);
}

// Panned voices have one delay, binaural ones two.
MixMode mode_of(Interpolation interpolation, const Panner* panner, const Hrtf* head) {
  MixMode mode;
  mode.interpolation = interpolation;
  mode.head = head != nullptr;
  if (panner == nullptr) return mode;
  mode.delays = 1;
  mode.pairs = panner->channels() / kEars;
  return mode;
}

// Null where turns of the head are to wait for keyframes.
std::unique_ptr<const HeadRotation> turns_for(const AuralizerOptions& options, const ItdTable* lags,
                                              const RadiationModel& field) {
  if (!options.tracks_head) return nullptr;
  const bool pair = options.output.kind == OutputFormat::Kind::kTwoReceivers;
  const double receiver_m = pair ? kEarDistance_m / 2 : 0;
  return std::make_unique<const HeadRotation>(
      lags, receiver_m * kSampleRate_hz / field.speed_of_sound_mps());
}

// All signals, and onsets after them.
std::vector<PreparedSignal> decode(const AuralizerInput& input, const MixMode& mode) {
  std::vector<PreparedSignal> decoded = prepare_signals(input.signals, mode);
  for (const Signal& onset : input.onsets) decoded.emplace_back(onset, mode);
  return decoded;
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
  std::vector<SignalDescription> shapes;
  for (const TimedEnvelope& signal : input.envelopes)
    shapes.push_back({signal.frames, signal.loop, signal.envelope.mean_square()});
  for (std::size_t i = 0; i < input.onsets.size(); ++i) {
    shapes[input.loop_of_onset[i]].onset = static_cast<std::uint32_t>(shapes.size());
    shapes.push_back(
        {input.onsets[i].samples.size(), false, shapes[input.loop_of_onset[i]].mean_square});
  }
  const std::uint64_t bytes = std::min(SoundLoader::bytes_of(shapes, mode),
                                       std::max(options.memory_bytes / 2, kMinSoundMemory_bytes));
  return std::make_unique<SoundLoader>(
      shapes, file.emitters(), mode,
      [&file, &input](std::size_t signal, std::size_t block) -> Result<std::vector<float>> {
        if (signal < file.signal_count()) return file.read_signal_block(signal, block);
        if (signal < input.envelopes.size())
          return block_of(input.signals[signal - file.signal_count()], block);
        return block_of(input.onsets[signal - input.envelopes.size()], block);
      },
      SoundBudget{bytes, !options.wait_for_pages}, max_keyframes_ahead(options.block_frames),
      std::clamp(static_cast<int>(std::thread::hardware_concurrency()) / 2, 1, 4));
}

}  // namespace

struct Auralizer::State {
  // From a file, or from the input's sources where there is none.
  State(AuralizerInput&& from, std::shared_ptr<const BakeFile> opened,
        const AuralizerOptions& options)
      : input(std::move(from)),
        file(std::move(opened)),
        wait_for_pages(options.wait_for_pages),
        first_sounds_end_s(LoadClock::steady_s(nullptr) + options.first_sounds_s),
        panner(options.output.make_panner()),
        head(options.output.head),
        mode(mode_of(options.interpolation, panner.get(), head.get())),
        sounds(file == nullptr ? nullptr : sounds_from(*file, input, mode, options)),
        decoded(file == nullptr ? decode(input, mode) : std::vector<PreparedSignal>()),
        signals(file == nullptr ? decoded : sounds->signals()),
        field(
            input.emitters, input.materials, input.air,
            LateBoost(input.decay, file == nullptr ? input.sources.size() : file->source_count())),
        weights(needs_list(options.strategy) ? mean_weights(signals)
                                             : weights_of(input, options.voices)),
        ceilings(file == nullptr ? weights : max_over_instances(weights, file->signal_maps())),
        choice(input, file.get(), field, weights, ceilings,
               sounds == nullptr ? 0 : sounds->budget_bytes(), options),
        script(options.script),
        maker(field, slots_for(choice.sampler()),
              panner == nullptr && head == nullptr ? KeyframeMaker::Receivers::kPair
                                                   : KeyframeMaker::Receivers::kOne,
              head, onset_signals(input)),
        receivers(options.output.receivers),
        keyframes_of_choice(options.strategy == "priority" && choice.moving() == nullptr
                                ? keyframes_of_a_choice(static_cast<std::size_t>(options.voices))
                                : 1),
        adapting(options.adapt),
        clock(options.sampler_clock),
        limit_of_k(choice.sampler().capacity()),
        turns(turns_for(options, maker.lags(), field)),
        settled(keyframes_of_choice > 1 ? kKeyframesToSettle : 1),
        mixer(signals, slots_for(choice.sampler()), mode, panner.get(), head.get(), sounds.get(),
              {static_cast<float>(options.gain * options.output.diffuse_gain()), options.limit,
               options.adapt, options.block_frames, options.audio_clock, turns.get()}) {
    stop_when(options.stop);
  }

  void stop_when(const std::atomic<bool>* wanted) {
    stop = wanted;
    choice.sampler().stop_when(wanted);
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

  // What sounds at the place, now or some keyframes ago.
  std::span<const SampledSource> chosen(const Listener& listener, const Reception& reception,
                                        double time_s) {
    Sampler& sampler = choice.sampler();
    if (made < next_choice) return sample;
    sampler.set_reception(reception);
    if (script != nullptr) (void)script->apply(*choice.moving(), time_s);  // its own sources
    choice_keyframes = made > 0 ? keyframes_of_choice : 1;
    const double start_s = choice_keyframes > 1 ? clock.now() : 0;
    sample = sampler.sample(listener, time_s);
    while (wait_for_pages && !is_stopped() && !sampler.complete())
      sample = sampler.sample(listener, time_s);
    next_choice = made + choice_keyframes;
    choice_took_s = choice_keyframes > 1 ? clock.now() - start_s : 0;
    return sample;
  }

  bool is_stopped() const { return stop != nullptr && stop->load(std::memory_order_relaxed); }

  // How many sources to choose, after a keyframe took so long.
  void adapt_k(double took_s) {
    limit_of_k.keyframe_took(took_s * kSampleRate_hz / kKeyframeFrames, mixer.shed_share(),
                             mixer.is_full());
    choice.sampler().set_voice_count(limit_of_k.voices());
    late_keyframes.store(limit_of_k.late(), std::memory_order_relaxed);
  }

  AuralizerInput input;
  const std::shared_ptr<const BakeFile> file;
  const bool wait_for_pages;
  const double first_sounds_end_s;
  const std::unique_ptr<const Panner> panner;
  const std::shared_ptr<const Hrtf> head;
  const MixMode mode;
  const std::unique_ptr<SoundLoader> sounds;  // of a file; otherwise they are
  const std::vector<PreparedSignal> decoded;  // already
  const std::span<const PreparedSignal> signals;
  const RadiationModel field;
  const SignalWeights weights, ceilings;

  // Sampler thread.
  SamplingPipeline choice;
  const std::atomic<bool>* stop = nullptr;     // a caller's
  const std::shared_ptr<MovingScript> script;  // moves the choice's, if a caller does not
  KeyframeMaker maker;
  const ReceiverPattern receivers;
  ListenerMotion motion{kKeyframe_s};
  std::span<const SampledSource> sample;  // the sampler's
  // That a choice serves: of as many voices as are asked for, however many there is time for. Where
  // a crowd gets fewer, choosing takes not much less time than before, and no keyframe is late for
  // having to choose anew.
  const std::size_t keyframes_of_choice;
  double choice_took_s = 0;
  std::size_t choice_keyframes = 1;
  std::uint64_t made = 0, next_choice = 0;
  std::uint64_t held_frames = 0;  // by which keyframes come later than their number says
  const bool adapting;
  const LoadClock clock;
  SamplerLoadControl limit_of_k;
  const std::unique_ptr<const HeadRotation> turns;  // null unless they are followed
  KeyframeLead lead;                                // for those who are followed
  const std::uint64_t settled;  // the first keyframe that tells how fast the machine is

  BlockMixer mixer;

  // Statistics.
  std::atomic<std::uint64_t> keyframes{0}, rays{0}, late_sources{0}, late_keyframes{0};
  std::atomic<std::uint64_t> bounded_keyframes{0};
  std::atomic<std::uint32_t> voices{0}, k{0}, min_k{0};
  std::atomic<double> sampler_ms{0};
};

Auralizer::Auralizer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Auralizer::~Auralizer() = default;

Result<void> Auralizer::check(const AuralizerOptions& options) {
  if (options.voices < 1)
    return Error("cannot mix " + std::to_string(options.voices) + " voices; ask for 1 or more.");
  if (const auto right = clamor::check(strategy_options_of(options)); !right.ok()) return right;
  if (options.rays < 1)
    return Error("cannot look for what hides sources with " + std::to_string(options.rays) +
                 " rays a keyframe; ask for 1 or more, or for no visibility.");
  if (!std::isfinite(options.gain) || options.gain < 0)
    return Error("the output gain must be a finite amplitude, 0 or more; 1 leaves it as it is.");
  for (const float exponent : options.output.receivers.exponent)
    if (!(exponent >= 0 && exponent <= 100))
      return Error("a receiver's exponent must lie between 0, alike from everywhere, and 100.");
  if (options.block_frames < 1 || options.block_frames > kLargestBlock_frames)
    return Error("cannot mix blocks of " + std::to_string(options.block_frames) +
                 " frames; ask for 1 to " + std::to_string(kLargestBlock_frames) + ".");
  if (options.moving.max_sources > kMaxMovingSources)
    return Error("there may be at most " + std::to_string(kMaxMovingSources) +
                 " moving sources at a time.");
  if (options.moving.max_sources > 0 && !takes_moving(options.strategy))
    return Error("the strategy " + in_quotes(options.strategy) +
                 " knows nothing of moving sources; take 'priority' or 'all'.");
  return {};
}

Result<std::unique_ptr<Auralizer>> Auralizer::create(AuralizerInput input,
                                                     const AuralizerOptions& options) {
  if (const auto right = check(options); !right.ok()) return right.error();
  if (const auto right = clamor::check(input); !right.ok()) return right.error();
  if (input.sources.empty() && options.moving.max_sources == 0) return nothing_to_hear();
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
    if (const auto read = read_occluders(*file, *input); !read.ok()) return read.error();
  if (listed) {
    auto auralizer = create(std::move(*input), options);
    if (!auralizer.ok()) return auralizer.error().in(file->path());
    return auralizer;
  }
  if (file->source_count() == 0 && options.moving.max_sources == 0)
    return nothing_to_hear().in(file->path());
  if (const auto added = add_kinds(options.moving, *input, file.get()); !added.ok())
    return added.error().in(file->path());
  auto state = std::make_unique<State>(std::move(*input), file, options);
  if (const PageStatistics pages = state->choice.loader()->statistics(); pages.failed > 0)
    return Error(pages.failure);
  return std::unique_ptr<Auralizer>(new Auralizer(std::move(state)));
}

bool Auralizer::wants_keyframe() const {
  State& state = *state_;
  state.held_frames = state.mixer.held_frames();
  return state.mixer.wants_keyframe(state.turns == nullptr ? BlockMixer::kAllAhead_s
                                                           : state.lead.seconds());
}

double Auralizer::next_keyframe_time_s() const {
  return static_cast<double>(state_->made * kKeyframeFrames + state_->held_frames) / kSampleRate_hz;
}

void Auralizer::make_keyframe(const Listener& at) {
  State& state = *state_;
  Keyframe* const keyframe = state.mixer.writable();
  if (keyframe == nullptr) return;
  const double start_s = state.clock.now();
  const double time_s = next_keyframe_time_s();
  const bool chooses = state.made >= state.next_choice;
  const Listener listener = state.motion.next(at);
  const Reception reception(state.receivers, listener);
  state.maker.make(state.chosen(listener, reception, time_s), listener, *keyframe, reception,
                   state.held_frames);
  keyframe->facing = listener_axes(listener);
  state.play(*keyframe);
  if (chooses) state.choice.improve_occlusion();
  const double spent_s = state.clock.now() - start_s;
  // The first waits for sounds and pages, as none does after it.
  if (state.made > 0) state.lead.made(spent_s, state.mixer.held_blocks());
  // A choice takes of each keyframe that it serves its part.
  const double took_s = spent_s - (chooses ? state.choice_took_s : 0) +
                        state.choice_took_s / static_cast<double>(state.choice_keyframes);
  if (state.adapting && state.made >= state.settled) state.adapt_k(took_s);

  state.voices.store(static_cast<std::uint32_t>(keyframe->voices.size()),
                     std::memory_order_relaxed);
  state.sampler_ms.store(1e3 * took_s, std::memory_order_relaxed);
  state.k.store(static_cast<std::uint32_t>(state.limit_of_k.voices()), std::memory_order_relaxed);
  state.min_k.store(static_cast<std::uint32_t>(state.limit_of_k.min_so_far()),
                    std::memory_order_relaxed);
  if (const VisibilityCache* const occlusion = state.choice.occlusion()) {
    state.rays.store(occlusion->statistics().rays, std::memory_order_relaxed);
    state.late_sources.store(occlusion->statistics().late, std::memory_order_relaxed);
  }
  state.bounded_keyframes.store(state.choice.sampler().bounded_keyframes(),
                                std::memory_order_relaxed);
  state.keyframes.fetch_add(1, std::memory_order_relaxed);
  ++state.made;
  state.mixer.publish(*keyframe);
}

void Auralizer::face(const Listener& listener) { state_->mixer.face(listener_axes(listener)); }

void Auralizer::stop_when(const std::atomic<bool>* stop) { state_->stop_when(stop); }

void Auralizer::mix(std::span<float> interleaved) noexcept REALTIME {
  state_->mixer.mix(interleaved);
}

MovingSources* Auralizer::moving() {
  return state_->script == nullptr ? state_->choice.moving() : nullptr;
}

int Auralizer::channels() const noexcept REALTIME {
  return static_cast<int>(state_->mixer.channels());
}

AuralizerStatistics Auralizer::statistics() {
  State& state = *state_;
  const BlockStatistics mixed = state.mixer.statistics();
  AuralizerStatistics statistics;
  statistics.keyframes = state.keyframes.load(std::memory_order_relaxed);
  statistics.held_blocks = mixed.held_blocks;
  statistics.voices = state.voices.load(std::memory_order_relaxed);
  statistics.sampler_ms = state.sampler_ms.load(std::memory_order_relaxed);
  std::copy(mixed.peak.begin(), mixed.peak.end(), statistics.peak);
  statistics.clipped_frames = mixed.clipped_frames;
  statistics.bad_voices = mixed.bad_voices;
  statistics.limited = mixed.limited;
  statistics.rays = state.rays.load(std::memory_order_relaxed);
  statistics.k = state.k.load(std::memory_order_relaxed);
  statistics.min_k = state.min_k.load(std::memory_order_relaxed);
  statistics.max_k = static_cast<std::uint32_t>(state.choice.sampler().capacity());
  statistics.late_keyframes = state.late_keyframes.load(std::memory_order_relaxed);
  statistics.shed_voices = mixed.shed_voices;
  statistics.max_shed_voices = mixed.max_shed_voices;
  statistics.shedding_blocks = mixed.shedding_blocks;
  statistics.bounded_keyframes = state.bounded_keyframes.load(std::memory_order_relaxed);
  statistics.late_sources = state.late_sources.load(std::memory_order_relaxed);
  if (const PageLoader* const loader = state.choice.loader())
    statistics.pages = loader->statistics();
  if (state.sounds != nullptr) statistics.sounds = state.sounds->statistics();
  statistics.sounds.late = mixed.late_voices;
  return statistics;
}

}  // namespace clamor
