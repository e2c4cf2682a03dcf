// render_command.cpp: clamor render: what a listener hears, to a WAV file.
#include <algorithm>
#include <cmath>
#include <optional>
#include <ostream>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "common/sample_rate.h"
#include "formats/audio/audio_file.h"
#include "formats/bake_file/bake_file.h"
#include "formats/level/walk_file.h"
#include "runtime/player/render.h"
#include "tools/commands/audibility_warnings.h"
#include "tools/commands/commands.h"
#include "tools/commands/mix_options.h"
#include "tools/commands/output_options.h"
#include "tools/commands/strategy_options.h"
#include "tools/program/arguments.h"
#include "tools/program/interrupt.h"
#include "tools/program/progress.h"
#include "tools/program/stop_deadline.h"

namespace clamor {

namespace {

double decibels(double amplitude) { return 20 * std::log10(std::max(amplitude, 1e-10)); }

// A render is right or none: what stands in for a page that cannot be read will do for a player,
// and so will silence for a sound.
Result<void> all_was_read(Auralizer& auralizer) {
  const AuralizerStatistics statistics = auralizer.statistics();
  if (statistics.pages.failed > 0) return Error(statistics.pages.failure);
  if (statistics.sounds.failed > 0) return Error(statistics.sounds.failure);
  return {};
}

}  // namespace

int run_render(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  std::string level, output, listener, walk_path, format;
  double seconds = 0;
  bool limit = false;
  AuralizerOptions options;
  Arguments parser("render",
                   "Renders what a listener hears, standing still or on a walk, to a WAV or "
                   "FLAC file at 48 kHz: the player's own mix, faster than real time.",
                   "clamor render hall.clamor -o hall.wav --listener 0,1.7,3,180 --seconds 10");
  parser.positional("level", level, "the bake file");
  parser.option(
      "-o,--output", output,
      "the file to write: .wav or .flac; or a device or pipe such as /dev/stdout, as WAV");
  parser.required("-o");
  parser.option("--listener", listener,
                "X,Y,Z[,YAW[,PITCH]] in metres and degrees; yaw 0 looks to -Z");
  parser.option("--walk", walk_path, "a scripted path instead, PATH.json");
  parser.option("--seconds", seconds, "how long; unset: the walk's length, or 10");
  const StrategyArguments strategy(parser);
  MixArguments mix(parser);
  const OutputArguments output_words(parser);
  parser.flag("--limit", limit,
              "keep true peaks below -1 dBFS; unset: only where samples are not float");
  parser.option("--format", format,
                "of the samples: float, 32, 24 or 16; unset: float, or 24 in a .flac file");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  const auto chosen = strategy.read();
  if (!chosen.ok()) return parser.bad_usage(err, chosen.error().message);
  use(*chosen, options);

  if (listener.empty() == walk_path.empty())
    return parser.bad_usage(err, "give either --listener X,Y,Z or --walk PATH.json");
  if (const auto read = mix.read(options); !read.ok())
    return parser.bad_usage(err, read.error().message);
  const auto shape = output_words.read();
  if (!shape.ok()) return parser.bad_usage(err, shape.error().message);
  options.output = *shape;
  if (const auto right = check_sound_file(output, shape->channels()); !right.ok())
    return parser.bad_usage(err, "-o: " + right.error().message);
  const auto samples = sample_format(format, output);
  if (!samples.ok()) return parser.bad_usage(err, "--format: " + samples.error().message);
  options.limit = limit || *samples != SampleFormat::kFloat32;
  if (!(seconds >= 0 && seconds <= 86400))
    return parser.bad_usage(err, "--seconds must lie between 0 and 86400");

  const auto fail = [&err](const Error& error) {
    fmt::print(err, "clamor render: {}\n", error.message);
    return kBadInput;
  };
  InputFiles inputs;
  inputs.add(level);
  inputs.add(walk_path);
  Walk walk;
  if (!listener.empty()) {
    const auto pose = parse_listener(listener);
    if (!pose.ok()) return parser.bad_usage(err, pose.error().message);
    walk = Walk::standing(*pose);
  } else {
    auto read = Walk::read(walk_path);
    if (!read.ok()) return fail(read.error());
    walk = std::move(*read);
  }
  if (seconds == 0) seconds = walk.length_s() > 0 ? walk.length_s() : 10;

  auto file = BakeFile::open(level, mix.access());
  if (!file.ok()) return fail(file.error());
  if (const auto read = output_words.read_head(options.output, inputs); !read.ok())
    return fail(read.error());
  if (const auto read = mix.read_script(options, file->signal_count(), inputs); !read.ok())
    return fail(read.error());
  if (const auto target = OutputTarget::find(output, inputs); !target.ok())
    return fail(target.error());
  if (!options.script)
    if (const auto warning = audibility_warning(
            *file, walk, {.seconds = seconds, .with_occlusion = options.visibility}))
      fmt::print(err, "warning: {}\n", *warning);
  options.wait_for_pages = true;
  const Interrupt interrupt;
  const Error stopped("stopped; nothing was written. Run the same command again.");
  std::optional<StopDeadline> deadline("clamor render: " + stopped.message);
  options.stop = &Interrupt::requested();
  auto auralizer = Auralizer::create(std::make_shared<const BakeFile>(std::move(*file)), options);
  if (!auralizer.ok()) return fail(auralizer.error().in(level));
  auto wav =
      WavWriter::create(output, shape->channels(), kSampleRate_hz, *samples, shape->speakers());
  if (!wav.ok()) return fail(wav.error());

  Progress progress(err, "  rendering");
  const auto frames = static_cast<std::uint64_t>(std::llround(seconds * kSampleRate_hz));
  const auto channels = static_cast<std::size_t>(shape->channels());
  std::uint64_t done = 0;
  double energy = 0, peak = 0;
  const auto take = [&](std::span<const float> block) {
    for (const float sample : block) {
      energy += static_cast<double>(sample) * sample;
      peak = std::max(peak, static_cast<double>(std::abs(sample)));
    }
    done += block.size() / channels;
    const double rate = static_cast<double>(done) / kSampleRate_hz / progress.seconds();
    progress.update(static_cast<double>(done) / static_cast<double>(frames),
                    fmt::format("{:.1f} x real time", rate));
    if (const auto whole = all_was_read(**auralizer); !whole.ok()) return whole;
    return wav->write(block);
  };
  const auto rendered = render(**auralizer, walk, frames, take, options.stop);
  if (Interrupt::requested()) return fail(stopped);
  deadline.reset();
  if (!rendered.ok()) return fail(rendered.error());
  if (const auto finished = wav->finish(); !finished.ok()) return fail(finished.error());

  const AuralizerStatistics statistics = (*auralizer)->statistics();
  const double elapsed_s = std::max(progress.seconds(), 1e-6);
  fmt::print(
      err,
      "wrote {}: {:.2f} s, {} voices, peak {:.1f} dBFS, RMS {:.1f} dBFS, {:.1f} times faster "
      "than real time\n",
      output, seconds, statistics.voices, decibels(peak),
      decibels(std::sqrt(energy / static_cast<double>(frames * channels))), seconds / elapsed_s);
  if (const std::string note = output_words.default_output_note(); !note.empty())
    fmt::print(err, "{}\n", note);
  if (statistics.clipped_frames > 0)
    fmt::print(err, "warning: {} frames go beyond full scale; --gain {:.0f}dB would not clip\n",
               statistics.clipped_frames,
               std::floor(decibels(options.gain) - decibels(peak) - 0.1));
  if (statistics.limited.frames > 0)
    fmt::print(err, "the limiter worked on {:.1f} % of the frames, by up to {:.1f} dB\n",
               100 * static_cast<double>(statistics.limited.frames) / static_cast<double>(frames),
               -decibels(static_cast<double>(statistics.limited.min_gain)));
  if (statistics.bad_voices > 0)
    fmt::print(err, "warning: {} voices were silenced because a number in them was not finite\n",
               statistics.bad_voices);
  return kSuccess;
}

}  // namespace clamor
