// impulse_command.cpp: clamor impulse: impulse response and room parameters per octave band.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <ostream>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/cpu_time.h"
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
#include "tools/program/progress.h"
#include "tools/program/quiet_option.h"
#include "tools/program/stage_notice.h"
#include "tools/program/terminal_output.h"
#include "tools/report/room.h"
#include "tools/report/room_response.h"

namespace clamor {

namespace {

struct Options {
  std::string level, output, emitter;
  std::vector<Vec3> listeners_m;
  std::size_t sample = 0;  // sources chosen for each listener; 0: as `strategy` says
  double seconds = 0;      // 0: until the last arrival has decayed
  StrategyOptions strategy;
  bool json = false;
  std::string visibility = "on";
};

struct Measured {
  Vec3 listener_m{};
  std::vector<float> waveform;
  RoomParameters of_energy, of_waveform;
  std::optional<std::string> warning;  // why little or nothing is heard
};

// Writes one channel per listener; shorter ones end in silence.
Result<void> write_wav(const std::string& path, std::span<const Measured> all) {
  Result<WavWriter> wav =
      WavWriter::create(path, static_cast<int>(all.size()), kSampleRate_hz, SampleFormat::kFloat32);
  if (!wav) return wav.error();
  std::size_t frames = 0;
  for (const Measured& one : all) frames = std::max(frames, one.waveform.size());
  std::vector<float> samples(frames * all.size(), 0);
  for (std::size_t c = 0; c < all.size(); ++c)
    for (std::size_t i = 0; i < all[c].waveform.size(); ++i)
      samples[i * all.size() + c] = all[c].waveform[i];
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

// The emitter that sounds.
Result<std::uint32_t> emitter_of(const Options& options, const std::vector<Emitter>& emitters,
                                 std::ostream& notes) {
  if (emitters.empty())
    return Error("the file has no emitters, so nothing can be heard. Bake it with one.");
  if (!options.emitter.empty()) return find_emitter(emitters, options.emitter);
  if (emitters.size() > 1)
    notes << fmt::format("{} emitters; measuring the first, {}. Choose another with --from.\n",
                         emitters.size(), in_quotes(emitters[0].name));
  return std::uint32_t{0};
}

// Gives the arrivals at a place of the world. Reads the file once for all places.
class ResponseSource {
 public:
  ResponseSource(const BakeFile& file, const Options& options, std::uint32_t emitter)
      : file_(file), options_(options), emitter_(emitter) {}

  Result<void> read() {
    if (options_.sample > 0) {
      auto room = Room::read(file_);
      if (!room) return room.error();
      room_ = std::move(*room);
      if (options_.visibility != "on")
        room_.surfaces = std::make_unique<OcclusionGeometry>(Mesh(), file_.materials());
      meter_.emplace(
          room_, Excitation{emitter_, "", free_field_energy_at_10m(file_.emitters()[emitter_])});
      return {};
    }
    Result<ExpandedSources> all = read_expanded_sources(file_);
    if (!all) return all.error();
    for (Source& source : all->sources) source.emitter = all->stored_as[source.emitter];
    sources_ = std::move(all->sources);
    Mesh mesh;
    if (options_.visibility == "on" && uses_occlusion(options_.strategy.strategy)) {
      Result<Mesh> read = read_mesh_at_rest(file_);
      if (!read) return read.error().in(options_.level);
      mesh = std::move(*read);
    }
    surfaces_.emplace(mesh, file_.materials());
    return {};
  }

  std::vector<Arrival> arrivals_at(const Vec3& listener_m) const {
    if (meter_) return meter_->measure(listener_m, options_.sample).arrivals;
    return sampled_response(options_.strategy, sources_, file_.emitters(), file_.materials(),
                            file_.settings().air, listener_m - file_.origin_m(), emitter_,
                            LateBoost(file_.statistics().decay, sources_.size()), &*surfaces_);
  }

 private:
  const BakeFile& file_;
  const Options& options_;
  std::uint32_t emitter_;
  std::vector<Source> sources_;
  std::optional<OcclusionGeometry> surfaces_;
  Room room_;  // with a number of sources, instead of those two
  std::optional<RoomMeter> meter_;
};

Result<Measured> measure_at(const Vec3& listener_m, const ResponseSource& source,
                            const Options& options, const BakeFile& file, std::uint32_t emitter,
                            std::ostream& notes, std::ostream& err) {
  Measured measured;
  measured.listener_m = listener_m;
  measured.warning =
      audibility_warning(file, Walk::standing({listener_m}),
                         {.emitter = emitter, .with_occlusion = options.visibility == "on"});
  const std::vector<Arrival> arrivals = source.arrivals_at(listener_m);
  const Emitter& sounding = file.emitters()[emitter];
  if (arrivals.empty())
    return Error(measured.warning.value_or("nothing of " + in_quotes(sounding.name) +
                                           " reaches the listener. Move --listener inside the "
                                           "level."))
        .in(options.level);
  if (measured.warning) print_warning(err, *measured.warning);

  const std::size_t frames =
      options.seconds > 0 ? static_cast<std::size_t>(std::lround(options.seconds * kSampleRate_hz))
                          : whole_response_frames(arrivals);
  const std::size_t first = first_response_frame(arrivals);
  if (first > 0)
    notes << fmt::format("The sound travels for {:.1f} s; the waveform begins with its arrival\n",
                         arrivals.front().time_s);
  const Bands at_10m = free_field_energy_at_10m(sounding);
  measured.waveform = impulse_response(arrivals, frames, first);
  measured.of_energy = room_parameters(arrivals, at_10m);
  measured.of_waveform = room_parameters(std::span<const float>(measured.waveform), at_10m);
  return measured;
}

Result<std::vector<Measured>> measure(const Options& options, std::ostream& notes,
                                      std::ostream& err) {
  const Result<BakeFile> file = BakeFile::open(options.level, FileAccess::kMap);
  if (!file) return file.error();
  const auto emitter = emitter_of(options, file->emitters(), notes);
  if (!emitter) return emitter.error().in(options.level);
  StageNotice notice(notes);
  notice.begin("reading the sources");
  ResponseSource source(*file, options, *emitter);
  if (auto read = source.read(); !read) return read.error();
  notice.begin("measuring at the listeners");
  std::vector<Measured> all;
  Progress progress(notes, "  listeners");
  const double core_s = process_time_s();
  for (const Vec3& listener_m : options.listeners_m) {
    auto measured = measure_at(listener_m, source, options, *file, *emitter, notes, err);
    if (!measured) return measured.error();
    all.push_back(std::move(*measured));
    if (options.listeners_m.size() == 1) continue;
    const auto held = notice.hold();
    progress.update(
        static_cast<double>(all.size()) / static_cast<double>(options.listeners_m.size()),
        {fmt::format("{} of {}", all.size(), options.listeners_m.size())});
  }
  notice.end();
  if (all.size() > 1)
    notes << fmt::format("  measured {} listeners, {:.2f} s of a core each\n", all.size(),
                         (process_time_s() - core_s) / static_cast<double>(all.size()));
  return all;
}

nlohmann::ordered_json as_json(const Measured& measured) {
  nlohmann::ordered_json json;
  json["energy"] = to_json(measured.of_energy);
  json["waveform"] = to_json(measured.of_waveform);
  json["warnings"] = nlohmann::ordered_json::array();
  if (measured.warning) json["warnings"].push_back(*measured.warning);
  return json;
}

void print(std::span<const Measured> all, bool wants_json, std::ostream& out) {
  const auto place = [](const Vec3& at_m) { return std::array{at_m.x, at_m.y, at_m.z}; };
  if (!wants_json) {
    for (const Measured& measured : all) {
      if (all.size() > 1)
        out << fmt::format("listener {:g},{:g},{:g}\n", measured.listener_m.x,
                           measured.listener_m.y, measured.listener_m.z);
      print_table("energy", measured.of_energy, out);
      print_table("waveform", measured.of_waveform, out);
    }
    return;
  }
  nlohmann::ordered_json json;
  for (const double hz : kBandCentres_hz) json["bands_hz"].push_back(static_cast<int>(hz));
  if (all.size() == 1) {
    json.update(as_json(all.front()));
  } else {
    for (const Measured& measured : all) {
      nlohmann::ordered_json one = {{"listener_m", place(measured.listener_m)}};
      one.update(as_json(measured));
      json["places"].push_back(std::move(one));
    }
  }
  out << printable_json(json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace)) << '\n';
}

}  // namespace

int run_impulse(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  Options options;
  std::vector<std::string> listeners;
  Arguments parser(
      "impulse",
      "Measures the impulse response at a listener and the room parameters (ISO 3382-1) "
      "per octave band, from the energy response, which is free of random phases, and "
      "from the waveform. A dash (null in --json) means that the response is too "
      "short. Without --voices and --strategy all sources count; with --voices alone, an unbiased "
      "sample is chosen for each listener, in less time.",
      "clamor impulse hall.clamor -o ir.wav --listener 2,1.7,-3");
  parser.positional("bake", options.level, "the bake file");
  parser.option("-o,--output", options.output,
                "also write the waveform: WAV, 48 kHz, float, a channel per listener");
  parser.option("--listener", listeners,
                "position X,Y,Z in metres; may be repeated, and the bake is read once for all");
  parser.required("--listener");
  parser.option("--from", options.emitter, "name of the emitter that sounds [unset: the first]");
  parser.option("--seconds", options.seconds, "length of the waveform, at most 60; 0: all of it");
  parser.option("--visibility", options.visibility, "on or off: occlusion of sources by surfaces");
  parser.words("--visibility", {"on", "off"});
  parser.flag("--json", options.json, "print the parameters as JSON");
  const StrategyArguments strategy(parser, "all");
  QuietOption quiet(parser);
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  const auto chosen = strategy.read();
  if (!chosen.ok()) return parser.bad_usage(err, chosen.error().message);
  options.strategy = *chosen;
  if (parser.given("--voices") && !parser.given("--strategy")) options.sample = chosen->voices;
  if (options.visibility != "on" && options.visibility != "off")
    return parser.bad_usage(err,
                            "--visibility must be on or off, not " + in_quotes(options.visibility));
  for (const std::string& listener : listeners) {
    const auto pose = parse_listener(listener);
    if (!pose.ok()) return parser.bad_usage(err, pose.error().message);
    options.listeners_m.push_back(pose->position_m);
  }
  if (!options.output.empty()) {
    const auto samples = sample_format("float", options.output);
    const auto right = check_sound_file(options.output, static_cast<int>(listeners.size()));
    if (!right.ok()) return parser.bad_usage(err, "-o: " + right.error().message);
    if (!samples.ok()) return parser.bad_usage(err, "-o: " + samples.error().message);
  }
  if (!(options.seconds >= 0 && options.seconds <= kMaxResponse_s))
    return parser.bad_usage(err, "--seconds must lie between 0 and 60");
  const auto fail = [&err](const Error& error) {
    print_error(err, "impulse", error.message);
    return kBadInput;
  };
  if (const auto can = check_output(options); !can) return fail(can.error());
  const auto measured = [&] {
    const ExitOnSignal stop("impulse");
    return measure(options, quiet.notes(err), err);
  }();
  if (!measured) return fail(measured.error());
  if (!options.output.empty()) {
    const Interrupt until_written;
    if (const auto written = write_wav(options.output, *measured); !written)
      return fail(written.error());
  }
  print(*measured, options.json, out);
  return kSuccess;
}

}  // namespace clamor
