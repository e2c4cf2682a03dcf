// impulse_command.cpp: clamor impulse: impulse response and room parameters per octave band.
#include <algorithm>
#include <cmath>
#include <optional>
#include <ostream>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/sample_rate.h"
#include "common/text.h"
#include "formats/audio/audio_file.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/bake_file/mesh_at_rest.h"
#include "formats/files/output_target.h"
#include "formats/level/emitter.h"
#include "formats/level/mesh.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/response/impulse_response.h"
#include "tools/analysis/room_parameters.h"
#include "tools/analysis/sampled_response.h"
#include "tools/commands/audibility_warnings.h"
#include "tools/commands/commands.h"
#include "tools/commands/strategy_options.h"
#include "tools/program/arguments.h"
#include "tools/program/interrupt.h"
#include "tools/program/stage_notice.h"
#include "tools/report/room.h"

namespace clamor {

namespace {

struct Options {
  std::string level, output, emitter;
  Vec3 listener_m{};
  double seconds = 0;  // 0: until the last arrival has decayed
  StrategyOptions strategy;
  bool json = false;
  std::string visibility = "on";
};

Result<void> write_wav(const std::string& path, std::span<const float> samples) {
  Result<WavWriter> wav = WavWriter::create(path, 1, kSampleRate_hz, SampleFormat::kFloat32);
  if (!wav) return wav.error();
  if (auto written = wav->write(samples); !written) return written;
  return wav->finish();
}

nlohmann::ordered_json to_json(const RoomParameters& parameters) {
  nlohmann::ordered_json json;
  for (const ParameterKind& kind : kParameterKinds) {
    auto& values = json[kind.key] = nlohmann::ordered_json::array();
    for (const auto& value : parameters.*kind.value)
      values.push_back(value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr));
  }
  return json;
}

void print_table(const char* title, const RoomParameters& parameters, std::ostream& out) {
  out << fmt::format("{:<10}", title);
  for (const double hz : kBandCentres_hz) out << fmt::format("{:>9} Hz", hz);
  out << '\n';
  for (const ParameterKind& kind : kParameterKinds) {
    out << fmt::format("  {:<8}", fmt::format("{} {}", kind.name, kind.unit));
    for (const auto& value : parameters.*kind.value)
      out << (value ? fmt::format("{:>12.{}f}", *value, kind.digits) : fmt::format("{:>12}", "-"));
    out << '\n';
  }
}

// Checks that the waveform can be written, and not to where the results are printed.
Result<void> check_output(const Options& options) {
  if (options.output.empty()) return {};
  InputFiles inputs;
  inputs.add(options.level);
  const auto target = OutputTarget::find(options.output, inputs);
  if (!target.ok()) return target.error();
  if (target->is_stdout())
    return Error(options.output +
                 ": the room parameters are printed there; name a file for the waveform");
  return {};
}

struct Measured {
  std::vector<float> waveform;
  RoomParameters of_energy, of_waveform;
  std::optional<std::string> warning;  // why little or nothing is heard
};

Result<Measured> measure(const Options& options, std::ostream& err) {
  const Result<BakeFile> file = BakeFile::open(options.level, FileAccess::kMap);
  if (!file) return file.error();
  const std::vector<Emitter>& emitters = file->emitters();
  if (emitters.empty())
    return Error("the file has no emitters, so nothing can be heard. Bake it with one.")
        .in(options.level);
  std::uint32_t emitter = 0;
  if (!options.emitter.empty()) {
    const Result<std::uint32_t> found = find_emitter(emitters, options.emitter);
    if (!found) return found.error().in(options.level);
    emitter = *found;
  } else if (emitters.size() > 1) {
    err << fmt::format(
        "clamor impulse: {} emitters; measuring the first, {}. Choose another with --emitter.\n",
        emitters.size(), in_quotes(emitters[0].name));
  }

  StageNotice notice(err);
  notice.begin("reading the sources");
  Result<ExpandedSources> all = read_expanded_sources(*file);
  if (!all) return all.error();
  for (Source& source : all->sources) source.emitter = all->stored_as[source.emitter];
  Mesh mesh;
  if (options.visibility == "on" && uses_occlusion(options.strategy.strategy)) {
    Result<Mesh> read = read_mesh_at_rest(*file);
    if (!read) return read.error().in(options.level);
    mesh = std::move(*read);
  }
  const auto warning =
      audibility_warning(*file, Walk::standing({options.listener_m}),
                         {.emitter = emitter, .with_occlusion = options.visibility == "on"});
  notice.begin("finding what the listener hears");
  const OcclusionGeometry surfaces(mesh, file->materials());
  const std::vector<Arrival> arrivals =
      sampled_response(options.strategy, all->sources, emitters, file->materials(),
                       file->settings().air, options.listener_m - file->origin_m(), emitter,
                       LateBoost(file->statistics().decay, all->sources.size()), &surfaces);
  notice.end();
  if (arrivals.empty())
    return Error(warning.value_or("nothing of " + in_quotes(emitters[emitter].name) +
                                  " reaches the listener. Move --listener inside the level."))
        .in(options.level);
  if (warning) err << "warning: " << *warning << '\n';

  const std::size_t frames =
      options.seconds > 0 ? static_cast<std::size_t>(std::lround(options.seconds * kSampleRate_hz))
                          : whole_response_frames(arrivals);
  const std::size_t first = first_response_frame(arrivals);
  if (first > 0)
    err << fmt::format(
        "clamor impulse: the sound travels for {:.1f} s; the waveform begins with its arrival\n",
        arrivals.front().time_s);
  notice.begin("filtering the waveform");
  const Bands at_10m = free_field_energy_at_10m(emitters[emitter]);
  Measured measured;
  measured.waveform = impulse_response(arrivals, frames, first);
  measured.of_energy = room_parameters(arrivals, at_10m);
  measured.of_waveform = room_parameters(std::span<const float>(measured.waveform), at_10m);
  measured.warning = warning;
  return measured;
}

void print(const Measured& measured, bool as_json, std::ostream& out) {
  if (!as_json) {
    print_table("energy", measured.of_energy, out);
    print_table("waveform", measured.of_waveform, out);
    return;
  }
  nlohmann::ordered_json json;
  for (const double hz : kBandCentres_hz) json["bands_hz"].push_back(static_cast<int>(hz));
  json["energy"] = to_json(measured.of_energy);
  json["waveform"] = to_json(measured.of_waveform);
  json["warnings"] = nlohmann::ordered_json::array();
  if (measured.warning) json["warnings"].push_back(*measured.warning);
  out << printable_json(json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace)) << '\n';
}

}  // namespace

int run_impulse(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  Options options;
  std::string listener;
  Arguments parser(
      "impulse",
      "Measures the impulse response at a listener and the room parameters (ISO 3382-1) "
      "per octave band, from the energy response, which is free of random phases, and "
      "from the waveform. A dash (null in --json) means that the response is too "
      "short.",
      "clamor impulse hall.clamor -o ir.wav --listener 2,1.7,-3");
  parser.positional("bake", options.level, "the bake file");
  parser.option("-o,--output", options.output, "also write the waveform: WAV, mono, 48 kHz, float");
  parser.option("--listener", listener, "position X,Y,Z in metres");
  parser.required("--listener");
  parser.option("--emitter", options.emitter, "name of the emitter that sounds [unset: the first]");
  parser.option("--seconds", options.seconds, "length of the waveform, at most 60; 0: all of it");
  parser.option("--visibility", options.visibility, "on or off: occlusion of sources by surfaces");
  parser.words("--visibility", {"on", "off"});
  parser.flag("--json", options.json, "print the parameters as JSON");
  const StrategyArguments strategy(parser, "all");
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  const auto chosen = strategy.read();
  if (!chosen.ok()) return parser.bad_usage(err, chosen.error().message);
  options.strategy = *chosen;
  if (options.visibility != "on" && options.visibility != "off")
    return parser.bad_usage(err,
                            "--visibility must be on or off, not " + in_quotes(options.visibility));
  const auto pose = parse_listener(listener);
  if (!pose.ok()) return parser.bad_usage(err, pose.error().message);
  options.listener_m = pose->position_m;
  if (!options.output.empty()) {
    const auto samples = sample_format("float", options.output);
    const auto right = check_sound_file(options.output, 1);
    if (!right.ok()) return parser.bad_usage(err, "-o: " + right.error().message);
    if (!samples.ok()) return parser.bad_usage(err, "-o: " + samples.error().message);
  }
  if (!(options.seconds >= 0 && options.seconds <= kMaxResponse_s))
    return parser.bad_usage(err, "--seconds must lie between 0 and 60");
  const auto fail = [&err](const Error& error) {
    err << "clamor impulse: " << error.message << '\n';
    return kBadInput;
  };
  if (const auto can = check_output(options); !can) return fail(can.error());
  const auto measured = [&] {
    const ExitOnSignal stop("impulse");
    return measure(options, err);
  }();
  if (!measured) return fail(measured.error());
  if (!options.output.empty()) {
    const Interrupt until_written;
    if (const auto written = write_wav(options.output, measured->waveform); !written)
      return fail(written.error());
  }
  print(*measured, options.json, out);
  return kSuccess;
}

}  // namespace clamor
