#include "runtime/engine/auralizer.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <mutex>
#include <string>
#include <utility>

#include "common/text.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/level_extent.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/engine/keyframe_pacing.h"
#include "runtime/engine/output_stage.h"
#include "runtime/engine/replaceable_signals.h"
#include "runtime/engine/sample_focus.h"
#include "runtime/engine/sample_schedule.h"
#include "runtime/engine/sampling_pipeline.h"
#include "runtime/engine/signal_store.h"
#include "runtime/mixing/block_mixer.h"
#include "runtime/mixing/field_maker.h"
#include "runtime/mixing/head_rotation.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/sampling/moving_script.h"
#include "runtime/sampling/sampling_strategy.h"
#include "runtime/streaming/page_loader.h"

namespace clamor {

namespace {

// The first keyframes of a crowd are slow, because all pages and visibilities are new.
constexpr std::uint64_t kKeyframesToSettle = 50;

Error nothing_to_hear() {
  return Error("there are no sources to hear; bake the level with an emitter.");
}

// Without occlusion, parts are not read and do not matter.
Result<void> check_script(const AuralizerOptions& options, const AuralizerInput& input) {
  if (options.script == nullptr || !uses_occlusion(options)) return {};
  return options.script->parts().check(input.movable_parts);
}

// Null if head rotation comes with keyframes only.
std::unique_ptr<const HeadRotation> rotation_for(const AuralizerOptions& options,
                                                 const ItdTable* itd_table,
                                                 const RadiationModel& radiation) {
  if (!options.tracks_head) return nullptr;
  const bool pair = options.output.kind == OutputFormat::Kind::kTwoReceivers;
  const double receiver_m = pair ? kEarDistance_m / 2 : 0;
  return std::make_unique<const HeadRotation>(
      itd_table, receiver_m * kSampleRate_hz / radiation.speed_of_sound_mps());
}

// Sets the phases of looping signals to those after `begins_s` seconds.
void resume(AuralizerInput& input, const BakeFile* file, double begins_s) {
  if (begins_s == 0) return;
  const auto period_s = [&](std::size_t signal) {
    const bool is_stored = file != nullptr;
    const bool loop = is_stored ? file->signal(signal).loop : input.signals[signal].loop;
    const auto frames =
        is_stored ? file->signal(signal).frames : input.signals[signal].samples.size();
    return loop ? static_cast<double>(frames) / kSampleRate_hz : 0.0;
  };
  for (Emitter& emitter : input.emitters) {
    const double loop_s = period_s(emitter.signal);
    if (!(loop_s > 0)) continue;
    const double phase_s = std::fmod(emitter.delay_s - begins_s, loop_s);
    emitter.delay_s = phase_s < 0 ? phase_s + loop_s : phase_s;
  }
}

// Finds the portals that a script names.
Result<void> find_scripted_portals(const AuralizerOptions& options, const AuralizerInput& input) {
  if (options.script == nullptr) return {};
  return options.script->portals().find(input.portals.portals);
}

}  // namespace

struct Auralizer::State {
  // From a file, or without one from the input's sources.
  State(AuralizerInput&& from, std::shared_ptr<const BakeFile> opened, OutputStage&& last_stage,
        const AuralizerOptions& options)
      : input(std::move(from)),
        file(std::move(opened)),
        report(options.report),
        extent(file != nullptr && report ? LevelExtent(*file, mesh_of(input)) : LevelExtent()),
        output(std::move(last_stage)),
        store(file.get(), input, output.mode, options),
        slots(options.moving.signal_slots, static_cast<std::uint32_t>(store.signals().size()),
              output.mode),
        first_kind(input.emitters.size() - kinds_of(options.moving)),
        radiation(
            input.emitters, input.materials, input.air,
            LateBoost(input.decay, file == nullptr ? input.sources.size() : file->source_count())),
        pipeline(input, file.get(), radiation, store.signals(), store.budget(), slots.weights(),
                 options, output.mode.field),
        schedule(pipeline, options,
                 output.mode.field ? kTapFade_keyframes
                                   : keyframes_per_sample(static_cast<std::size_t>(options.voices)),
                 output.mode.field ? kCoarsestField : 1),
        script(options.script),
        maker(radiation, output.slots(pipeline.sampler().capacity()), output.receivers(),
              output.hrtf, onset_signals(input, slots.slots()),
              output.mode.field ? KeyframeMaker::Fade{kTapFade_keyframes, true}
                                : KeyframeMaker::Fade{}),
        field(output.mode.field ? std::make_unique<FieldMaker>(
                                      radiation, PlayableSignals(store.signals(), slots.playable()),
                                      FieldMaker::Ears{output.mode, output.hrtf.get(),
                                                       maker.itd_table(), output.panner.get(),
                                                       options.has_dense_late, output.field_voices},
                                      output.chooses_taps)
                                : nullptr),
        pacing(options, pipeline.sampler().capacity(), schedule.spacing(),
               schedule.spacing().least > 1 ? kKeyframesToSettle : 1),
        receivers(options.output.receivers),
        focus(radiation, input.emitters),
        keeps_keyframe(options.keeps_keyframe),
        keeps_sample(options.keeps_sample),
        mixes_voices(options.mixes_voices),
        rotation(rotation_for(options, maker.itd_table(), radiation)),
        mixer({store.signals(), slots.playable()}, output.slots(pipeline.sampler().capacity()),
              output.mode, output.panner.get(), output.hrtf.get(), store.loader(),
              {static_cast<float>(options.gain * options.output.diffuse_gain()), options.limit,
               options.adapt, options.block_frames, options.audio_clock, rotation.get()}) {
    counted.max_k = static_cast<std::uint32_t>(pipeline.sampler().capacity());
    schedule.stop_when(options.stop);
    if (!options.wait_for_pages) pipeline.sampler().set_sounds(store.loader());
  }

  void count_keyframe(std::size_t voices, const WorkTime& took_s) {
    const std::lock_guard lock(counting);
    ++counted.keyframes;
    counted.voices = static_cast<std::uint32_t>(voices);
    counted.taps = field != nullptr ? static_cast<std::uint32_t>(field->taps()) : 0;
    counted.sampler_ms = 1e3 * took_s.cpu;
    counted.k = static_cast<std::uint32_t>(pacing.load().voices());
    counted.min_k = static_cast<std::uint32_t>(pacing.load().min_so_far());
    counted.late_keyframes = pacing.load().late();
    counted.starved_keyframes = pacing.load().starved();
    counted.waiting_share = std::max(pacing.load().waiting_share(), mixer.waiting_share());
    counted.keyframes_per_sample = static_cast<std::uint32_t>(pacing.load().spacing());
    counted.lead_s = pacing.lead_s();
    counted.max_lead_s = pacing.max_lead_s();
    pipeline.count(counted);
  }

  SamplerStatistics counted_so_far() const {
    const std::lock_guard lock(counting);
    return counted;
  }

  // A listener in the level's own coordinates.
  Listener in_level(Listener listener) const {
    listener.position_m -= input.origin_m;
    return listener;
  }

  // Opens and closes portals as the script says.
  void follow_script(double time_s) {
    if (script == nullptr || script->portals().is_empty()) return;
    pipeline.set_portals(script->portals().openness(time_s));
  }

  AuralizerInput input;
  const std::shared_ptr<const BakeFile> file;  // or null
  const std::function<void(const char* sentence)> report;
  const LevelExtent extent;
  bool reported_listener = false, reported_source = false;  // as outside of the level
  const OutputStage output;
  SignalStore store;

  // Used by the sampler thread.
  ReplaceableSignals slots;
  const std::size_t first_kind;  // emitter of the first kind of moving sources
  RadiationModel radiation;
  SamplingPipeline pipeline;
  SampleSchedule schedule;
  const std::shared_ptr<MovingScript> script;  // or null
  KeyframeMaker maker;
  const std::unique_ptr<FieldMaker> field;  // or null
  KeyframePacing pacing;
  const ReceiverPattern receivers;
  ListenerMotion motion{kKeyframe_s};
  std::uint64_t made = 0;         // keyframes
  std::uint64_t held_frames = 0;  // by which keyframes are due later than their number says
  SampleFocus focus;
  const bool keeps_keyframe, keeps_sample, mixes_voices;
  Keyframe newest;                 // if it is kept
  std::vector<HeardSource> heard;  // likewise
  double newest_time_s = 0;

  const std::unique_ptr<const HeadRotation> rotation;  // null unless head rotation is tracked
  BlockMixer mixer;
  mutable std::mutex counting;
  SamplerStatistics counted;  // guarded by it: the sampler writes, any thread reads
};

Auralizer::Auralizer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Auralizer::~Auralizer() = default;

Result<void> Auralizer::check(const AuralizerOptions& options) {
  if (options.voices < 1 || options.voices > kMaxVoices)
    return Error("cannot mix " + std::to_string(options.voices) + " voices; ask for 1 to " +
                 std::to_string(kMaxVoices) + ".");
  if (options.rays < 1)
    return Error("cannot trace occlusion with " + std::to_string(options.rays) +
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
  if (options.moving.max_sources > 0 && !strategy_options_of(options).takes_moving_sources())
    return Error("the strategy " + in_quotes(strategy_options_of(options).name()) +
                 " knows nothing of moving sources; take 'priority' or 'all'.");
  return {};
}

Result<std::unique_ptr<Auralizer>> Auralizer::create(AuralizerInput input,
                                                     const AuralizerOptions& options) {
  if (const auto right = check(options); !right.ok()) return right.error();
  if (const auto right = clamor::check(input); !right.ok()) return right.error();
  if (const auto right = check_script(options, input); !right.ok()) return right.error();
  if (input.sources.empty() && options.moving.max_sources == 0) return nothing_to_hear();
  resume(input, nullptr, options.begins_s);
  if (const auto added = add_kinds(options.moving, input); !added.ok()) return added.error();
  if (const auto found = find_scripted_portals(options, input); !found.ok()) return found.error();
  auto output = OutputStage::of(options, input);
  if (!output.ok()) return output.error();
  return std::unique_ptr<Auralizer>(new Auralizer(
      std::make_unique<State>(std::move(input), nullptr, std::move(*output), options)));
}

Result<std::unique_ptr<Auralizer>> Auralizer::create(std::shared_ptr<const BakeFile> file,
                                                     const AuralizerOptions& options) {
  if (const auto right = check(options); !right.ok()) return right.error();
  const bool listed = strategy_options_of(options).needs_list();
  auto input = listed ? read_auralizer_input(*file) : read_tables(*file);
  if (!input.ok()) return input.error();
  if (uses_occlusion(options) || reflects_moving_sources(*file, options))
    if (const auto read = read_occluders(*file, *input); !read.ok()) return read.error();
  if (listed) {
    auto auralizer = create(std::move(*input), options);
    if (!auralizer.ok()) return auralizer.error().in(file->path());
    return auralizer;
  }
  if (file->source_count() == 0 && options.moving.max_sources == 0)
    return nothing_to_hear().in(file->path());
  resume(*input, file.get(), options.begins_s);
  if (const auto added = add_kinds(options.moving, *input, file.get()); !added.ok())
    return added.error().in(file->path());
  if (const auto right = check_script(options, *input); !right.ok()) return right.error();
  if (const auto found = find_scripted_portals(options, *input); !found.ok()) return found.error();
  auto output = OutputStage::of(options, *input);
  if (!output.ok()) return output.error();
  auto state = std::make_unique<State>(std::move(*input), file, std::move(*output), options);
  if (const PageStatistics pages = state->pipeline.loader()->statistics(); pages.failed > 0)
    return Error(pages.failure);
  return std::unique_ptr<Auralizer>(new Auralizer(std::move(state)));
}

bool Auralizer::wants_keyframe() const {
  State& state = *state_;
  state.held_frames = state.mixer.held_frames();
  return state.mixer.wants_keyframe(state.pacing.lead_s(), state.rotation != nullptr);
}

double Auralizer::next_keyframe_time_s() const {
  return static_cast<double>(state_->made * kKeyframeFrames + state_->held_frames) / kSampleRate_hz;
}

void Auralizer::make_keyframe(const Listener& at) {
  State& state = *state_;
  Keyframe* const keyframe = state.mixer.writable();
  if (keyframe == nullptr) return;
  const WorkTime start_s = state.pacing.now_s();
  const Listener listener = state.motion.next(state.in_level(at));
  const bool samples = state.schedule.is_due(state.made, listener);
  const double keyframe_s = next_keyframe_time_s();
  const Reception reception(state.receivers, listener);
  state.follow_script(keyframe_s);
  std::span<const std::uint64_t> tested;
  if (state.field != nullptr) tested = state.field->voices();
  auto sample = state.schedule.sample(state.made, listener, reception, keyframe_s, tested);
  if (state.made == 0 && state.store.load_first(state.pipeline.sampler().unheard())) {
    state.schedule.expire();
    sample = state.schedule.sample(state.made, listener, reception, keyframe_s, tested);
  }
  auto voices = state.focus.apply(sample, listener);
  WorkTime before_s, field_s;  // a field's, with its voices, which are few
  if (state.field != nullptr) {
    before_s = state.pacing.now_s();
    voices = state.field->divide(voices, samples, listener, keyframe_s);
  }
  state.maker.make(voices, listener, *keyframe, reception, state.held_frames);
  if (state.field != nullptr) {
    state.field->make(listener, reception, *keyframe);
    field_s = state.pacing.now_s() - before_s;
  }
  keyframe->facing = listener_axes(listener);
  state.store.play(*keyframe, state.pipeline.sampler().unheard(),
                   state.field != nullptr ? state.field->reads() : std::span<const Voice>());
  if (samples && state.keeps_sample) state.focus.describe(sample, listener, state.heard);
  if (samples) state.pipeline.improve_occlusion();
  const WorkTime spent_s = state.pacing.now_s() - start_s;
  const WorkTime part_s =
      state.schedule.part_s(spent_s - field_s, samples) + state.pacing.mean_s(field_s);
  if (state.pacing.made(state.made, spent_s, part_s, state.mixer)) {
    state.pipeline.sampler().set_voice_count(state.pacing.load().voices());
    state.schedule.space(state.pacing.load().spacing(), state.pacing.kept());
    if (state.field != nullptr) state.field->coarsen(state.pacing.coarseness());
  }
  state.count_keyframe(keyframe->voices.size(), part_s);
  ++state.made;
  if (state.keeps_keyframe) {
    state.newest = *keyframe;
    state.newest_time_s = keyframe_s;
  }
  if (!state.mixes_voices) keyframe->voices.clear();
  state.mixer.publish(*keyframe);
  if (state.field != nullptr)
    state.field->for_signals([&](std::uint32_t signal) { state.slots.name(signal, *keyframe); });
  state.slots.made(*keyframe, state.made - state.mixer.waiting());
}

void Auralizer::warm_up(const Listener& at) {
  State& state = *state_;
  assert(state.made == 0);
  const Listener listener = state.in_level(at);
  state.schedule.warm_up(listener, Reception(state.receivers, listener), next_keyframe_time_s());
  state.store.load_first(state.pipeline.sampler().unheard(), kFirstSounds_s);
}

void Auralizer::skip(std::uint64_t frames) {
  assert(state_->made == 0);
  state_->mixer.skip(frames);
}

void Auralizer::check_place(PlaceOf thing, const Vec3& place_m) {
  const bool is_source = thing == PlaceOf::kSource;
  bool& is_reported = is_source ? state_->reported_source : state_->reported_listener;
  if (is_reported) return;
  const auto complaint = state_->extent.complaint(is_source ? "a source" : "the listener", place_m);
  if (!complaint) return;
  is_reported = true;
  state_->report((state_->file->path() + ": " + *complaint).c_str());
}

bool Auralizer::load() {
  PageLoader* const pages = state_->pipeline.loader();
  PageLoader* const probes = state_->pipeline.probe_loader();
  SoundLoader* const sounds = state_->store.loader();
  return (pages != nullptr && pages->load_next()) || (sounds != nullptr && sounds->load_next()) ||
         (probes != nullptr && probes->load_next());
}

void Auralizer::turn_head(const Listener& listener) {
  state_->mixer.turn_head(listener_axes(listener));
}

void Auralizer::stop_when(const std::atomic<bool>* stop) { state_->schedule.stop_when(stop); }

void Auralizer::mix(std::span<float> interleaved) noexcept REALTIME {
  state_->mixer.mix(interleaved);
}

MovingSources* Auralizer::moving() { return state_->schedule.moving(); }
MovingParts* Auralizer::parts() { return state_->schedule.parts(); }
std::span<const PartHandle> Auralizer::level_parts() const {
  return state_->pipeline.level_parts();
}

ReplaceableSignals& Auralizer::signal_slots() { return state_->slots; }
const ReplaceableSignals& Auralizer::signal_slots() const { return state_->slots; }

void Auralizer::set_signal(std::size_t slot, SlotSignal signal) {
  ReplaceableSignals& slots = state_->slots;
  slots.set(slot, std::move(signal));
  state_->maker.set_onset(slots.signal_of(slot), slots.onset_of(slot));
}

void Auralizer::clear_signal(std::size_t slot) {
  state_->slots.clear(slot);
  state_->pipeline.forget_removed(state_->slots.signal_of(slot));
}

void Auralizer::set_kind(std::uint32_t kind, std::size_t slot, const Bands& directivity) {
  const std::size_t index = state_->first_kind + kind;
  Emitter& emitter = state_->input.emitters[index];
  emitter.signal = state_->slots.signal_of(slot);
  emitter.directivity = directivity;
  state_->radiation.update_signal(index);
}

void Auralizer::limit_group(std::uint16_t group, double share) {
  const double voices = share * static_cast<double>(state_->pacing.load().voices());
  state_->pipeline.limit_group(group, share >= 1 ? std::numeric_limits<std::size_t>::max()
                                                 : static_cast<std::size_t>(std::ceil(voices)));
}

void Auralizer::set_emitter_powers(std::vector<float> powers) {
  state_->pipeline.set_emitter_powers(std::move(powers));
}

void Auralizer::set_portals(std::vector<float> openness) {
  state_->pipeline.set_portals(std::move(openness));
}

void Auralizer::set_focus(const SoloSettings& focus) { state_->focus.set(focus); }

std::span<const HeardSource> Auralizer::newest_sample() const { return state_->heard; }

double Auralizer::newest_keyframe_time_s() const { return state_->newest_time_s; }

const MixMode& Auralizer::mode() const { return state_->output.mode; }

const Keyframe* Auralizer::newest_keyframe() const {
  return state_->keeps_keyframe && state_->made > 0 ? &state_->newest : nullptr;
}

int Auralizer::channels() const noexcept REALTIME {
  return static_cast<int>(state_->mixer.channels());
}

AuralizerStatistics Auralizer::statistics() {
  State& state = *state_;
  AuralizerStatistics statistics{state.counted_so_far(), state.mixer.statistics()};
  if (const PageLoader* const loader = state.pipeline.loader())
    statistics.pages = loader->statistics();
  if (const SoundLoader* const sounds = state.store.loader())
    statistics.sounds = sounds->statistics();
  statistics.sounds.late = statistics.late_voices;
  return statistics;
}

}  // namespace clamor
