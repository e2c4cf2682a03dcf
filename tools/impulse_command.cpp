// clamor impulse: an impulse response as a WAV file, and the room's parameters per octave band.
#include "tools/impulse_command.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <ostream>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "formats/audio_file.h"
#include "formats/bake_file.h"
#include "runtime/energy_response.h"
#include "runtime/impulse_response.h"
#include "runtime/room_parameters.h"

namespace clamor {

namespace {

constexpr int kSuccess = 0, kBadInput = 1, kBadUsage = 2;
constexpr double kLongest_s = 60;

struct Options {
  std::string level, output, emitter;
  std::vector<double> listener_m;
  double seconds = 0;  // 0: until the last arrival has rung out
  bool json = false;
};

struct Row {
  const char* key;
  const char* title;
  RoomParameters::Value RoomParameters::*value;
  int digits;
};
constexpr Row kRows[] = {
    {"edt_s", "EDT s", &RoomParameters::edt_s, 3}, {"t20_s", "T20 s", &RoomParameters::t20_s, 3},
    {"t30_s", "T30 s", &RoomParameters::t30_s, 3}, {"c80_db", "C80 dB", &RoomParameters::c80_db, 2},
    {"d50", "D50", &RoomParameters::d50, 3},       {"ts_s", "Ts s", &RoomParameters::ts_s, 4},
    {"g_db", "G dB", &RoomParameters::g_db, 2},
};

// Letters to insert, remove or replace to turn one name into the other.
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

Result<std::uint32_t> find_emitter(const std::vector<Emitter>& emitters, const std::string& name) {
  std::string names;
  const Emitter* nearest = nullptr;
  for (std::size_t i = 0; i < emitters.size(); ++i) {
    const Emitter& emitter = emitters[i];
    if (emitter.name == name) return static_cast<std::uint32_t>(i);
    if (nearest == nullptr || edits(name, emitter.name) < edits(name, nearest->name))
      nearest = &emitter;
    if (i < 20) names += (i == 0 ? "" : ", ") + clamor::quoted(emitter.name);
  }
  if (emitters.size() > 20) names += fmt::format(" and {} more", emitters.size() - 20);
  return Error(fmt::format("no emitter is called {}; the nearest name is {}. Name one of {}.",
                           clamor::quoted(name), clamor::quoted(nearest->name), names));
}

Result<void> write_wav(const std::string& path, std::span<const float> samples) {
  Result<WavWriter> wav = WavWriter::create(path, 1, kSampleRate_hz, SampleFormat::kFloat32);
  if (!wav) return wav.error();
  if (auto written = wav->write(samples); !written) return written;
  return wav->finish();
}

nlohmann::ordered_json to_json(const RoomParameters& parameters) {
  nlohmann::ordered_json json;
  for (const Row& row : kRows) {
    auto& values = json[row.key] = nlohmann::ordered_json::array();
    for (const auto& value : parameters.*row.value)
      values.push_back(value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr));
  }
  return json;
}

void print_table(const char* title, const RoomParameters& parameters, std::ostream& out) {
  out << fmt::format("{:<10}", title);
  for (const double hz : kBandCentres_hz) out << fmt::format("{:>9} Hz", hz);
  out << '\n';
  for (const Row& row : kRows) {
    out << fmt::format("  {:<8}", row.title);
    for (const auto& value : parameters.*row.value)
      out << (value ? fmt::format("{:>12.{}f}", *value, row.digits) : fmt::format("{:>12}", "-"));
    out << '\n';
  }
}

Result<void> measure(const Options& options, std::ostream& out, std::ostream& err) {
  const Result<BakeFile> file = BakeFile::open(options.level);
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
        "clamor impulse: {} emitters, taking the first, {}; --emitter names another.\n",
        emitters.size(), clamor::quoted(emitters[0].name));
  }

  const Result<std::vector<Source>> sources = file->read_all_sources();
  if (!sources) return sources.error();
  const Vec3 listener_m(options.listener_m[0], options.listener_m[1], options.listener_m[2]);
  const std::vector<Arrival> arrivals = energy_response(*sources, emitters, file->materials(),
                                                        file->settings().air, listener_m, emitter);
  if (arrivals.empty())
    return Error("nothing of " + clamor::quoted(emitters[emitter].name) +
                 " reaches the listener. Move --listener inside the level.")
        .in(options.level);

  const double seconds = std::min(kLongest_s, options.seconds);
  const std::size_t frames = seconds > 0
                                 ? static_cast<std::size_t>(std::lround(seconds * kSampleRate_hz))
                                 : whole_response_frames(arrivals);
  const std::vector<float> waveform = impulse_response(arrivals, frames);
  if (!options.output.empty())
    if (auto written = write_wav(options.output, waveform); !written) return written;

  const Bands at_10m = free_field_energy_at_10m(emitters[emitter]);
  const RoomParameters of_energy = room_parameters(arrivals, at_10m);
  const RoomParameters of_waveform = room_parameters(std::span<const float>(waveform), at_10m);
  if (options.json) {
    nlohmann::ordered_json json;
    json["bands_hz"] = kBandCentres_hz;
    json["energy"] = to_json(of_energy);
    json["waveform"] = to_json(of_waveform);
    out << json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
  } else {
    print_table("energy", of_energy, out);
    print_table("waveform", of_waveform, out);
  }
  return {};
}

}  // namespace

int run_impulse(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  Options options;
  CLI::App app(
      "Impulse response at a listener, and the room's parameters (ISO 3382-1) per octave band,\n"
      "from the energy response, which carries no chance of phase, and from the waveform.\n"
      "A dash (null in --json) stands where a response is too short to tell.",
      "clamor impulse");
  app.add_option("level", options.level, "the bake file")->required()->type_name("LEVEL.clamor");
  app.add_option("-o,--output", options.output, "the waveform: WAV, mono, 48 kHz, float")
      ->type_name("IR.wav");
  app.add_option("--listener", options.listener_m, "where to listen, in metres")
      ->required()
      ->delimiter(',')
      ->expected(3)
      ->type_name("X,Y,Z");
  app.add_option("--emitter", options.emitter, "which emitter sounds (default: the first)")
      ->type_name("NAME");
  app.add_option("--seconds", options.seconds,
                 "length of the waveform (default: all of it), at most 60")
      ->check(CLI::Range(0.001, kLongest_s))
      ->type_name("S");
  app.add_flag("--json", options.json, "parameters as JSON on standard output");
  app.footer("example: clamor impulse hall.clamor -o ir.wav --listener 2,1.7,-3 --json");

  try {
    // CLI11 takes them last first.
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    out << app.help();
    return kSuccess;
  } catch (const CLI::ParseError& error) {
    err << "clamor impulse: " << error.what() << ". See clamor impulse --help.\n";
    return kBadUsage;
  }
  if (!std::all_of(options.listener_m.begin(), options.listener_m.end(),
                   [](double x) { return std::isfinite(x); })) {
    err << "clamor impulse: --listener needs three finite numbers, X,Y,Z in metres.\n";
    return kBadUsage;
  }
  if (options.output.empty() && !options.json) {
    err << "clamor impulse: nothing to do: give -o IR.wav, --json or both.\n";
    return kBadUsage;
  }
  if (const Result<void> done = measure(options, out, err); !done) {
    err << "clamor impulse: " << done.error().message << '\n';
    return kBadInput;
  }
  return kSuccess;
}

}  // namespace clamor
