#include "tools/commands/sound_options.h"

#include <memory>
#include <utility>

#include <fmt/format.h>

#include "formats/audio/audio_file.h"
#include "formats/audio/wav_writer.h"
#include "formats/level/emitter_spec.h"
#include "runtime/engine/output_stage.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/sampling/moving_script.h"

namespace clamor {

namespace {

constexpr int kMaxRays = 1'000'000'000;  // more than any level needs
constexpr double kMaxOutputGain = 1e10;  // 200 dB

}  // namespace

void add_strategy_options(Arguments& parser, StrategyOptions& options) {
  std::string of_paper;
  std::vector<std::string> names;
  for (const StrategyInfo& info : kStrategies) {
    names.emplace_back(info.name);
    if (*info.section != '\0')
      of_paper += fmt::format("{}{} ({})", of_paper.empty() ? "" : ", ", info.name, info.section);
  }
  parser.option("--strategy", options.strategy,
                "how sources are chosen: priority; all (no sampling); or one of the paper's "
                "strategies, with its section: " +
                    of_paper);
  parser.words("--strategy", std::move(names));
  parser.option("--voices", options.voices, {1, kMaxVoices}, "number of sources to choose (k)");
  parser.choice("--estimator", options.estimator,
                {{"power", Estimator::kPower}, {"amplitude", Estimator::kAmplitude}},
                "which sum is unbiased: power; or amplitude, as in the paper, which is too loud "
                "with few voices");
  parser.option("--strategy-seed", options.tuning.seed, "seed of the paper's strategies");
  parser.option("--redraw", options.tuning.redraw_s, "full-resampling: seconds between samples");
  parser.option("--exchange", options.tuning.exchange_per_s,
                "stochastic-diffusion: share of the sample exchanged per second (q)");
  parser.option(
      "--epsilon", options.tuning.epsilon,
      "adaptive-diffusion: change of weight, as a factor, at which a source is exchanged");
  parser.option("--candidates", options.tuning.candidates_per_voice,
                "octree-diffusion: candidates per voice that the octree returns");
  parser.then([&options] { return check(options); });
}

MixArguments::MixArguments(Arguments& parser, AuralizerOptions& options) {
  add_strategy_options(parser, strategy_);
  options.mixing = Mixing::kAuto;
  parser.choice("--mixer", options.mixing,
                {{"auto", Mixing::kAuto}, {"field", Mixing::kField}, {"voices", Mixing::kVoices}},
                "how the chosen sources are mixed: voices; field: all but the loudest 256 as "
                "responses that are convolved with the signals; or auto, a field from 4000 sources "
                "on");
  parser.choice(
      "--late", options.has_dense_late, {{"stored", false}, {"dense", true}},
      "late sound: as stored, with few and strong reflections; or dense, as in a room, by "
      "a field");
  parser.choice("--interpolation", options.interpolation,
                {{"cubic", Interpolation::kCubic}, {"linear", Interpolation::kLinear}},
                "cubic or linear; linear mixes a quarter more voices and loses 1 dB at 8 kHz");
  parser.choice("--visibility", options.visibility, {{"on", true}, {"off", false}},
                "on or off: occlusion of sources by surfaces");
  parser.option(
      "--rays", options.rays, {1, kMaxRays},
      "maximum number of occlusion rays per keyframe (50 keyframes a second); a render casts as "
      "many as it needs");
  parser.bytes("--memory", options.memory_bytes,
               "memory for the bake's pages and sounds, as in 64MB, of which sounds use up to half "
               "[64 MB for pages, and what all sounds take decoded, up to 256 MB]");
  parser.flag("--no-mmap", no_mmap_, "read the bake file instead of memory-mapping it");
  parser.option("--gain", gain_, "output gain: decibels, as in -6dB, or a factor, as in x0.5");
  parser.choice("--limiter", limiter_, {{"on", true}, {"off", false}},
                "on or off: limit true peaks to -1 dBFS, instead of letting them clip [unset: on, "
                "but off for a render of float samples]");
  parser.option("--moving", script_,
                "script of moving sources, movable parts (doors) and portals, SCRIPT.json");
  parser.then([this, &options]() -> Result<void> {
    options.strategy = make_strategy(strategy_);
    options.voices = static_cast<int>(strategy_.voices);
    if (limiter_) options.limit = *limiter_;
    const auto amplitude = parse_gain(gain_, kMaxOutputGain);
    if (!amplitude.ok()) return amplitude.error();
    options.gain = *amplitude;
    return check_mixing(options);
  });
}

Result<void> MixArguments::read_script(AuralizerOptions& options, std::size_t baked_signals,
                                       InputFiles& inputs) const {
  if (script_.empty()) return {};
  auto script = MovingScript::read(script_);
  if (!script.ok()) return script.error();
  inputs.add(script->files());
  options.moving = script->options(baked_signals);
  options.takes_parts = script->parts().adds_parts();
  options.script = std::make_shared<MovingScript>(std::move(*script));
  return {};
}

OutputArguments::OutputArguments(Arguments& parser, OutputFormat& format) {
  parser.flag("--headphones", headphones_, "binaural output for headphones; the default");
  parser.option("--hrtf", hrtf_, "SOFA file with the HRTF; implies --headphones [unset: KEMAR]");
  parser.flag("--loudspeakers", loudspeakers_,
              "output for two loudspeakers; implies --receivers wide");
  parser.option("--layout", layout_, "loudspeaker layout: stereo, 5.1, 7.1 or 7.1.4");
  parser.option(
      "--receivers", receivers_,
      "two virtual microphones 17 cm apart: wide (wide cardioids at 110 degrees), ortf (cardioids) "
      "or omni (omnidirectional, as in the paper)");
  parser.words("--layout", {"5.1", "7.1", "7.1.4"});
  parser.words("--receivers", {"wide", "ortf", "omni"});
  parser.flag("--ambisonics", ambisonics_,
              "third-order ambisonics: 16 channels, AmbiX (ACN, SN3D)");
  parser.then([this, &format]() -> Result<void> {
    if (loudspeakers_ && !receivers_.empty())
      return Error("give either --loudspeakers or --receivers, not both");
    const bool binaural = headphones_ || !hrtf_.empty() || !asked_for_any();
    const auto read = OutputFormat::from_options(binaural, layout_, ambisonics_,
                                                 loudspeakers_ ? "wide" : receivers_);
    if (!read.ok()) return read.error();
    format = *read;
    return {};
  });
}

bool OutputArguments::asked_for_any() const {
  return headphones_ || !hrtf_.empty() || loudspeakers_ || !layout_.empty() ||
         !receivers_.empty() || ambisonics_;
}

Result<void> OutputArguments::read_head(OutputFormat& format, InputFiles& inputs) const {
  if (format.kind != OutputFormat::Kind::kBinaural) return {};
  auto head = Hrtf::read(hrtf_);
  if (!head.ok() && !asked_for_any())
    return Error(head.error().message +
                 " The default output is for headphones; --loudspeakers needs no HRTF.");
  if (!head.ok()) return head.error();
  inputs.add(hrtf_);
  format.head = std::move(*head);
  return {};
}

std::string OutputArguments::default_output_note() const {
  if (asked_for_any()) return "";
  return "Mixed for headphones; use --loudspeakers or --layout 5.1 for loudspeakers.";
}

DeviceArguments::DeviceArguments(PlayerOptions& options) : options_(options) {
  options_.auralizer.limit = true;
  options_.auralizer.adapt = true;
  options_.auralizer.first_sounds_s = kFirstSoundsOfPlayer_s;
}

void DeviceArguments::add_device_options(Arguments& parser) {
  parser.option("--device", options_.device,
                "pulse, jack or alsa; the beginning or a part of a name that 'clamor devices' "
                "prints; or none");
  parser.words("--device", {"pulse", "jack", "alsa", "none"});
  parser.option("--rate", options_.device_rate_hz,
                "sample rate of the device in Hz; the mix is resampled [unset: 48000 if it has "
                "that]");
  parser.option("--frames", frames_, {16, 8192},
                "frames per block; PulseAudio and ALSA buffer four blocks, JACK sets its own size "
                "[unset: 256, and PulseAudio's buffer grows, up to 0.2 s, when the device runs dry "
                "twice in 30 s]");
}

void DeviceArguments::add_recording_options(Arguments& parser) {
  parser.option(
      "--record", options_.record,
      "also record to this .wav or .flac file, or as WAV to a device or pipe such as "
      "/dev/stdout. The file grows while it plays: whatever ends the program, a .wav file "
      "can be played to its end, a .flac file to less than a second before");
  parser.option("--format", format_,
                "sample format of the recording: float, 32, 24 or 16 [unset: float, or 24 for "
                ".flac]");
  parser.words("--format", {"float", "32", "24", "16"});
}

Result<void> DeviceArguments::interpret() {
  if (options_.device_rate_hz != 0 &&
      (options_.device_rate_hz < 8000 || options_.device_rate_hz > 384000))
    return Error("--rate must lie between 8000 and 384000");
  if (frames_ > 0) options_.block_frames = frames_;
  options_.buffer_may_grow = frames_ == 0;
  options_.auralizer.block_frames = options_.block_frames;
  if (!options_.record.empty())
    if (const auto right = check_sound_file(options_.record, options_.auralizer.output.channels());
        !right.ok())
      return Error("--record: " + right.error().message);
  const auto samples = sample_format(format_, options_.record);
  if (!samples.ok()) return Error("--format: " + samples.error().message);
  options_.record_format = *samples;
  return {};
}

}  // namespace clamor
