// render_command.cpp: clamor render: renders what a listener hears to a sound file.
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
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/player/render.h"
#include "tools/commands/commands.h"
#include "tools/commands/place_warnings.h"
#include "tools/commands/sound_options.h"
#include "tools/program/arguments.h"
#include "tools/program/interrupt.h"
#include "tools/program/progress.h"
#include "tools/program/quiet_option.h"
#include "tools/program/stage_notice.h"
#include "tools/program/terminal_output.h"
#include "tools/program/text_format.h"

namespace clamor {

namespace {

double decibels(double amplitude) { return 20 * std::log10(std::max(amplitude, 1e-10)); }

struct RenderRequest {
  std::string level, output, walk_path, format;
  std::optional<Listener> listener;
  double seconds = 0;
  AuralizerOptions options;
  Walk walk;
  SampleFormat samples = SampleFormat::kFloat32;
};

// Checks what depends on several options. The Error is bad usage.
Result<void> interpret(const Arguments& parser, RenderRequest& request) {
  if (request.listener.has_value() != request.walk_path.empty())
    return Error("give either --listener X,Y,Z or --walk PATH.json");
  if (parser.given("--seconds") && request.seconds * kSampleRate_hz < 1)
    return Error("--seconds must be at least one sample, 1/48000");
  const auto samples = sample_format(request.format, request.output);
  if (!samples.ok()) return Error("--format: " + samples.error().message);
  request.samples = *samples;
  if (!parser.given("--limiter")) request.options.limit = *samples != SampleFormat::kFloat32;
  if (const auto right = check_sound_file(request.output, request.options.output.channels());
      !right.ok())
    return Error("-o: " + right.error().message);
  request.options.wait_for_pages = true;
  if (request.listener) request.walk = Walk::standing(*request.listener);
  return {};
}

// Opens the bake and reads all other input files, then checks that the output replaces none.
Result<BakeFile> read_inputs(RenderRequest& request, const MixArguments& mix,
                             const OutputArguments& output) {
  InputFiles inputs;
  inputs.add(request.level);
  inputs.add(request.walk_path);
  if (!request.walk_path.empty()) {
    auto walk = Walk::read(request.walk_path);
    if (!walk.ok()) return walk.error();
    request.walk = std::move(*walk);
  }
  if (request.seconds == 0)
    request.seconds = request.walk.length_s() > 0 ? request.walk.length_s() : 10;
  auto file = BakeFile::open(request.level, mix.access());
  if (!file.ok()) return file;
  if (const auto read = output.read_head(request.options.output, inputs); !read.ok())
    return read.error();
  if (const auto read = mix.read_script(request.options, file->signal_count(), inputs); !read.ok())
    return read.error();
  if (const auto target = OutputTarget::find(request.output, inputs); !target.ok())
    return target.error();
  return file;
}

// Takes the rendered blocks: measures them, shows the progress and writes the file.
class RenderSink {
 public:
  RenderSink(WavWriter& wav, int channels, std::uint64_t frames, std::ostream& err)
      : wav_(wav),
        channels_(static_cast<std::size_t>(channels)),
        frames_(frames),
        progress_(err, "  rendering") {}

  // An Error if a page or sound could not be read: a player can replace a page by its parent's
  // samples and a sound by silence, but a render is exact or fails.
  Result<void> take(std::span<const float> block, const AuralizerStatistics& statistics) {
    for (const float sample : block) {
      energy_ += static_cast<double>(sample) * sample;
      peak_ = std::max(peak_, static_cast<double>(std::abs(sample)));
    }
    done_ += block.size() / channels_;
    const double rate = static_cast<double>(done_) / kSampleRate_hz / progress_.seconds();
    progress_.update(static_cast<double>(done_) / static_cast<double>(frames_),
                     {in_real_times(rate)});
    if (statistics.pages.failed > 0) return Error(statistics.pages.failure);
    if (statistics.sounds.failed > 0) return Error(statistics.sounds.failure);
    return wav_.write(block);
  }

  double peak() const { return peak_; }
  double rms() const { return std::sqrt(energy_ / static_cast<double>(frames_ * channels_)); }
  double seconds() const { return std::max(progress_.seconds(), 1e-6); }

 private:
  WavWriter& wav_;
  const std::size_t channels_;
  const std::uint64_t frames_;
  Progress progress_;
  std::uint64_t done_ = 0;
  double energy_ = 0, peak_ = 0;
};

void print_summary(const RenderRequest& request, const RenderSink& sink, std::uint64_t frames,
                   const AuralizerStatistics& statistics, const std::string& output_note,
                   std::ostream& err) {
  const std::string taps =
      statistics.taps > 0 ? fmt::format(" and {} taps", grouped(statistics.taps)) : "";
  fmt::print(err, "wrote {}: {:.2f} s, {} voice{}{}, peak {:.1f} dBFS, RMS {:.1f} dBFS, {}\n",
             request.output, request.seconds, statistics.voices, statistics.voices == 1 ? "" : "s",
             taps, decibels(sink.peak()), decibels(sink.rms()),
             in_real_times(request.seconds / sink.seconds()));
  if (!output_note.empty()) fmt::print(err, "{}\n", output_note);
  if (statistics.limited.frames > 0)
    fmt::print(err, "the limiter worked on {:.1f} % of the frames, by up to {:.1f} dB\n",
               100 * static_cast<double>(std::min(statistics.limited.frames, frames)) /
                   static_cast<double>(frames),
               -decibels(static_cast<double>(statistics.limited.min_gain)));
}

// The last block is mixed whole, so that more frames may clip or be limited than are written.
void print_warnings(const RenderRequest& request, const RenderSink& sink, std::uint64_t frames,
                    const AuralizerStatistics& statistics, std::ostream& err) {
  if (statistics.clipped_frames > 0)
    print_warning(
        err, fmt::format("{} frames exceed full scale; --gain {:.0f}dB avoids clipping",
                         std::min(statistics.clipped_frames, frames),
                         std::floor(decibels(request.options.gain) - decibels(sink.peak()) - 0.1)));
  if (statistics.bad_voices > 0)
    print_warning(err, fmt::format("{} voices were silenced because a value in them was not finite",
                                   statistics.bad_voices));
}

Result<void> render_to_file(RenderRequest& request, const MixArguments& mix,
                            const OutputArguments& output, std::ostream& notes, std::ostream& err) {
  auto file = read_inputs(request, mix, output);
  if (!file.ok()) return file.error();
  AuralizerOptions& options = request.options;
  print_place_warnings(*file, request.walk, request.seconds, options, err);
  const Interrupt interrupt;
  const Error stopped("stopped; nothing was written. Run the same command again.");
  std::optional<StopDeadline> deadline("clamor render: " + stopped.message);
  options.stop = &Interrupt::requested();
  StageNotice notice(notes);
  notice.begin("preparing the level's surfaces");
  auto auralizer = Auralizer::create(std::make_shared<const BakeFile>(std::move(*file)), options);
  if (!auralizer.ok()) return auralizer.error();
  const OutputFormat& format = options.output;
  auto wav = WavWriter::create(request.output, format.channels(), kSampleRate_hz, request.samples,
                               format.speakers());
  if (!wav.ok()) return wav.error();
  const auto frames = static_cast<std::uint64_t>(
      std::max(1LL, std::llround(request.seconds * kSampleRate_hz)));  // a walk may be shorter
  RenderSink sink(*wav, format.channels(), frames, notes);
  notice.begin("finding what the listener hears first");
  const auto take = [&](std::span<const float> block) {
    notice.end();
    return sink.take(block, (*auralizer)->statistics());
  };
  const auto rendered = render(**auralizer, request.walk, frames, take, options.stop);
  if (Interrupt::requested()) return stopped;
  deadline.reset();
  if (!rendered.ok()) return rendered;
  if (const auto finished = wav->finish(); !finished.ok()) return finished;
  print_summary(request, sink, frames, (*auralizer)->statistics(), output.default_output_note(),
                notes);
  print_warnings(request, sink, frames, (*auralizer)->statistics(), err);
  return {};
}

}  // namespace

int run_render(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  RenderRequest request;
  Arguments parser("render",
                   "Renders what a listener hears, standing or walking, to a WAV or FLAC file at "
                   "48 kHz: the same mix as 'clamor play', faster than real time.",
                   "clamor render hall.clamor -o hall.wav --listener 0,1.7,3,180 --seconds 10");
  parser.positional("bake", request.level, "the bake file");
  parser.option("-o,--output", request.output,
                "the .wav or .flac file to write; or a device or pipe such as /dev/stdout, as WAV");
  parser.required("-o");
  parser.listener("--listener", request.listener,
                  "position X,Y,Z[,YAW[,PITCH]] in metres and degrees; yaw 0 looks along -Z");
  parser.option("--walk", request.walk_path, "follow the path in PATH.json instead");
  parser.option("--seconds", request.seconds, "duration [unset: the length of the walk, or 10]");
  parser.within("--seconds", request.seconds, 0, 86400);
  MixArguments mix(parser, request.options);
  OutputArguments output(parser, request.options.output);
  QuietOption quiet(parser);
  parser.flag("--portable", request.options.portable,
              "the same samples on all machines, within -110 dB, for up to 1.7 times the CPU time: "
              "occlusion rays run SSE4.2, as those of bakes do");
  parser.option("--format", request.format,
                "sample format: float, 32, 24 or 16 [unset: float, or 24 for .flac]");
  parser.words("--format", {"float", "32", "24", "16"});
  parser.then([&] { return interpret(parser, request); });
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  return parser.end(err, render_to_file(request, mix, output, quiet.notes(err), err));
}

}  // namespace clamor
