// impulse_command.cpp: clamor impulse: impulse response and room parameters per octave band.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <ostream>
#include <vector>

#include <fmt/format.h>

#include "common/bands.h"
#include "common/cpu_time.h"
#include "common/printable.h"
#include "common/sample_rate.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/bake_file/mesh_at_rest.h"
#include "formats/level/emitter.h"
#include "formats/level/level_origin.h"
#include "formats/level/mesh.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/response/impulse_response.h"
#include "tools/analysis/room_parameters.h"
#include "tools/analysis/sampled_response.h"
#include "tools/commands/commands.h"
#include "tools/commands/impulse_output.h"
#include "tools/commands/place_warnings.h"
#include "tools/commands/places_file.h"
#include "tools/commands/sound_options.h"
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
  std::string level, emitter;
  std::vector<NamedPlace> places;
  std::size_t sample = 0;  // sources chosen for each place; 0: as `strategy` says
  double seconds = 0;      // 0: until the last arrival has decayed
  StrategyOptions strategy;
  bool json = false, visibility = true;
};

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

// Measures at one place of the world after another. Reads the file once for all.
class Measurement {
 public:
  Measurement(const Options& options, const BakeFile& file, std::uint32_t emitter,
              std::ostream& notes, std::ostream& err)
      : options_(options),
        file_(file),
        emitter_(file.emitters()[emitter]),
        number_(emitter),
        check_(file, options.visibility),
        notes_(notes),
        err_(err) {}

  Result<void> read() {
    if (options_.sample > 0) {
      auto room = Room::read(file_);
      if (!room) return room.error();
      room_ = std::move(*room);
      if (!options_.visibility)
        room_.surfaces = std::make_unique<OcclusionGeometry>(Mesh(), file_.materials());
      meter_.emplace(room_, Excitation{number_, "", free_field_energy_at_10m(emitter_)});
      return {};
    }
    Result<ExpandedSources> all = read_expanded_sources(file_);
    if (!all) return all.error();
    for (Source& source : all->sources) source.emitter = all->stored_as[source.emitter];
    sources_ = std::move(all->sources);
    Mesh mesh;
    if (options_.visibility && uses_occlusion(options_.strategy.strategy)) {
      Result<Mesh> read = read_mesh_at_rest(file_);
      if (!read) return read.error().in(options_.level);
      mesh = std::move(*read);
    }
    surfaces_.emplace(mesh, file_.materials(), sources_);
    return {};
  }

  Result<MeasuredPlace> measure(const NamedPlace& place) {
    MeasuredPlace measured;
    measured.place = place;
    measured.warning = check_.listener_warning(Walk::standing({place.at_m}), {.emitter = number_});
    const std::vector<Arrival> arrivals = arrivals_at(place.at_m);
    if (arrivals.empty() && !measured.warning)
      measured.warning = "nothing of " + in_quotes(emitter_.name) +
                         " reaches the listener. Move --listener inside the level.";
    // Where nothing is heard, one place is an error, and one of many is silent.
    if (arrivals.empty() && options_.places.size() == 1)
      return Error(*measured.warning).in(options_.level);
    if (measured.warning) warn(measured);

    const std::size_t frames =
        options_.seconds > 0
            ? static_cast<std::size_t>(std::max(1L, std::lround(options_.seconds * kSampleRate_hz)))
            : whole_response_frames(arrivals);
    const std::size_t first = first_response_frame(arrivals);
    if (first > 0)
      notes_ << fmt::format(
          "The sound travels for {:.1f} s; the waveform begins with its arrival\n",
          arrivals.front().time_s);
    const Bands at_10m = free_field_energy_at_10m(emitter_);
    measured.waveform = impulse_response(arrivals, frames, first);
    measured.of_energy = room_parameters(arrivals, at_10m);
    measured.of_waveform = room_parameters(std::span<const float>(measured.waveform), at_10m);
    return measured;
  }

  // Says how many warnings were not shown.
  void finish() {
    if (warned_ > kShownWarnings)
      print_warning(err_, fmt::format("{} more places have such a warning; --json tells each",
                                      warned_ - kShownWarnings));
  }

 private:
  static constexpr std::size_t kShownWarnings = 5;

  std::vector<Arrival> arrivals_at(const Vec3& listener_m) const {
    if (meter_) return meter_->measure(listener_m, options_.sample).arrivals;
    return sampled_response(options_.strategy, sources_, file_.emitters(), file_.materials(),
                            file_.settings().air, listener_m - file_.origin_m(), number_,
                            LateBoost(file_.statistics().decay, sources_.size()), &*surfaces_);
  }

  void warn(const MeasuredPlace& measured) {
    if (++warned_ > kShownWarnings) return;
    const bool is_alone = options_.places.size() == 1;
    print_warning(err_, (is_alone ? "" : measured.place.name + ": ") + *measured.warning);
  }

  const Options& options_;
  const BakeFile& file_;
  const Emitter& emitter_;
  const std::uint32_t number_;
  std::vector<Source> sources_;
  std::optional<OcclusionGeometry> surfaces_;
  Room room_;  // with a number of sources, instead of those two
  std::optional<RoomMeter> meter_;
  PlaceCheck check_;
  std::ostream& notes_;
  std::ostream& err_;
  std::size_t warned_ = 0;
};

std::string throughput(std::size_t places, double seconds, double core_s) {
  return fmt::format("  {} places in {:.1f} s: {:.3g} core-seconds a place\n", places, seconds,
                     core_s / static_cast<double>(places));
}

Result<std::vector<MeasuredPlace>> measure(const Options& options, const ImpulseOutput& output,
                                           std::ostream& notes, std::ostream& err) {
  const Result<BakeFile> file = BakeFile::open(options.level, FileAccess::kMap);
  if (!file) return file.error();
  const auto emitter = emitter_of(options, file->emitters(), notes);
  if (!emitter) return emitter.error().in(options.level);
  StageNotice notice(notes);
  notice.begin("reading the sources");
  Measurement measurement(options, *file, *emitter, notes, err);
  if (auto read = measurement.read(); !read) return read.error();
  notice.begin("measuring at the listeners");
  std::vector<MeasuredPlace> all;
  Progress progress(notes, "  listeners");
  const double core_s = process_time_s();
  const std::size_t count = options.places.size();
  for (const NamedPlace& place : options.places) {
    auto measured = measurement.measure(place);
    if (!measured) return measured.error();
    if (auto written = output.take(*measured); !written) return written.error();
    all.push_back(std::move(*measured));
    if (Interrupt::requested())
      return Error(
          fmt::format("stopped after {} of {} places, whose files are written", all.size(), count));
    if (count == 1) continue;
    const auto held = notice.hold();
    progress.update(static_cast<double>(all.size()) / static_cast<double>(count),
                    {fmt::format("{} of {}", all.size(), count)});
  }
  notice.end();
  measurement.finish();
  if (count > 1) notes << throughput(count, progress.seconds(), process_time_s() - core_s);
  return all;
}

// Ctrl-C ends it at once, or after the place under way if files are being written.
Result<std::vector<MeasuredPlace>> measure_until_stopped(const Options& options,
                                                         const ImpulseOutput& output,
                                                         std::ostream& notes, std::ostream& err) {
  if (output.is_folder()) {
    const Interrupt after_a_place;
    return measure(options, output, notes, err);
  }
  const ExitOnSignal stop("impulse");
  return measure(options, output, notes, err);
}

// Appends the places of a file, if there is one, and names those of all that have no name.
Result<void> add_places(const std::string& file, std::vector<NamedPlace>& places) {
  if (!file.empty()) {
    auto more = read_places(file);
    if (!more) return more.error();
    std::ranges::move(*more, std::back_inserter(places));
  }
  return complete_names(places);
}

}  // namespace

int run_impulse(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  Options options;
  std::string path, places_file;
  std::vector<std::string> listeners;
  Arguments parser(
      "impulse",
      "Measures the impulse response at a listener and the room parameters (ISO 3382-1) "
      "per octave band, from the energy response, which is free of random phases, and "
      "from the waveform. A dash (null in --json) means that the response is too "
      "short. Without --voices and --strategy all sources count; with --voices or --strategy "
      "priority, an unbiased sample is chosen for each place, in less time: half of it by energy, "
      "half for all times of the decay alike, which a player's sample reaches for 0.3 s only. Of "
      "several places, the CPU time of each is told at the end.",
      "clamor impulse hall.clamor -o ir.wav --listener 2,1.7,-3");
  parser.positional("bake", options.level, "the bake file");
  parser.option("-o,--output", path,
                "also write the waveform: WAV, 48 kHz, float, a channel per place; or a folder, as "
                "in responses/, with a file NAME.wav for each place");
  parser.option("--listener", listeners,
                "position X,Y,Z in metres; may be repeated, and the bake is read once for all");
  parser.option("--places", places_file,
                "file with a place on each line, X,Y,Z or X,Y,Z,NAME (CSV); places without a name "
                "are numbered, as in 001");
  parser.option("--from", options.emitter, "name of the emitter that sounds [unset: the first]");
  parser.option("--seconds", options.seconds, "length of the waveform, at most 60; 0: all of it");
  parser.within("--seconds", options.seconds, 0, kMaxResponse_s);
  parser.choice("--visibility", options.visibility, {{"on", true}, {"off", false}},
                "on or off: occlusion of sources by surfaces");
  parser.flag("--json", options.json, "print the parameters as JSON");
  options.strategy.strategy = "all";
  add_strategy_options(parser, options.strategy);
  QuietOption quiet(parser);
  if (const auto code = parser.parse(arguments, out, err)) return *code;
  if (parser.given("--voices") && !parser.given("--strategy"))
    options.strategy.strategy = "priority";
  if (options.strategy.strategy == "priority" && options.strategy.estimator == Estimator::kPower)
    options.sample = options.strategy.voices;
  if (listeners.empty() && places_file.empty())
    return parser.bad_usage(err, "say where to measure: --listener X,Y,Z or --places FILE");
  for (const std::string& listener : listeners) {
    const auto pose = parse_listener(listener);
    if (!pose.ok()) return parser.bad_usage(err, pose.error().message);
    options.places.push_back({pose->position_m, ""});
  }
  if (const auto added = add_places(places_file, options.places); !added)
    return parser.end(err, added);
  const auto output = ImpulseOutput::choose(path, options.places.size());
  if (!output.ok()) return parser.bad_usage(err, "-o: " + output.error().message);
  const auto measure_and_print = [&]() -> Result<void> {
    if (auto can = output->check(options.places, {options.level, places_file}); !can) return can;
    const auto measured = measure_until_stopped(options, *output, quiet.notes(err), err);
    if (!measured) return measured.error();
    {
      const Interrupt until_written;
      if (auto written = output->finish(*measured); !written) return written;
    }
    print_measured(*measured, options.json, out);
    return {};
  };
  return parser.end(err, measure_and_print());
}

}  // namespace clamor
