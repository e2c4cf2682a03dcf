// experiment_command.cpp: clamor experiment: measures the paper's figures and claims again.
#include <array>
#include <ostream>

#include <fmt/format.h>

#include "common/text.h"
#include "formats/bake_file/bake_file.h"
#include "tools/commands/commands.h"
#include "tools/experiments/experiments.h"
#include "tools/program/arguments.h"
#include "tools/program/interrupt.h"
#include "tools/program/progress.h"
#include "tools/program/quiet_option.h"
#include "tools/strategies/strategies.h"

namespace clamor {

namespace {

struct Known {
  const char* name;
  Experiment* run;
};
constexpr std::array<Known, 10> kExperiments = {{{"stadium", stadium_experiment},
                                                 {"violin", violin_experiment},
                                                 {"octave-bands", octave_bands_experiment},
                                                 {"convergence", convergence_experiment},
                                                 {"walk", walk_experiment},
                                                 {"field", field_experiment},
                                                 {"motion", motion_experiment},
                                                 {"probes", probes_experiment},
                                                 {"seeds", seeds_experiment},
                                                 {"room", room_experiment}}};

void add_options(Arguments& parser, ExperimentOptions& options, std::optional<Listener>& listener) {
  parser.listener("--listener", listener,
                  "X,Y,Z in metres [unset: amid the emitters, or 4 m in front of a single one]");
  parser.option("--seconds", options.seconds, "stadium: duration of each rendering");
  parser.within("--seconds", options.seconds, 0.5, 60);
  parser.option("--minutes", options.minutes, "motion: duration at each speed");
  parser.within("--minutes", options.minutes, 0.1, 600);
  parser.option("--readings", options.readings, {1, 100'000},
                "motion: readings of momentary loudness against all sources, at each speed");
  parser.option("--voices", options.voices, {1, kMaxVoices},
                "motion: number of sources to choose (k)");
  parser.option("--seeds", options.seeds, {2, 10000},
                "convergence, walk, octave-bands: random seeds per strategy and k");
  parser.option("--bakes", options.bakes, {2, 1000}, "seeds, room: number of seeds");
  parser.option(
      "--null", options.rolls, {19, 1000},
      "stadium: exact renderings with other phases, 19 or more; 100 take 5 times as long");
  parser.flag("--quick", options.quick, "few sources and few k: a quick test that everything runs");
}

Result<void> run_and_write(Experiment* run, const std::string& name, const std::string& folder,
                           const ExperimentOptions& options, std::ostream& notes) {
  InputFiles inputs;
  inputs.add(options.level);
  if (auto can = ReportPage::check_folder(folder, name, inputs); !can.ok()) return can;
  const Progress progress(notes, "  " + name);
  const auto report = [&] {
    const ExitOnSignal stop("experiment");
    return run(options, notes);
  }();
  if (!report.ok()) return report.error();
  const Interrupt until_written;
  if (auto written = report->write(folder); !written.ok()) return written;
  notes << fmt::format("wrote {0}/{1}.html, {1}.json and {2} tables as CSV in {3}\n", folder, name,
                       report->tables().size(), format_duration(progress.seconds()));
  return {};
}

}  // namespace

int run_experiment(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  ExperimentOptions options;
  std::string name, folder;
  std::optional<Listener> listener;
  Arguments parser(
      "experiment",
      "Repeats an experiment of the paper on a bake and writes the result beside the paper's "
      "claim: "
      "FOLDER/NAME.html with its pictures, and the tables as CSV and JSON.\n\n"
      "  stadium       figures 4 and 5: waveform error and audible differences, against k\n"
      "  violin        figure 6: impulse responses, diffuse and Phong 20, two speeds of sound\n"
      "  octave-bands  Phong exponents that rise with the band; bands sampled separately or "
      "together\n"
      "  convergence   loudness and error against k over many seeds; time per keyframe\n"
      "  walk          share of the sample exchanged per metre, and loudness meanwhile\n"
      "  field         error against CPU time for voices, for taps and for both\n"
      "  motion        ten minutes of walking, running and flying: clicks, loudness, keyframe "
      "times\n"
      "  probes        reflections through probes against bakes of --readings places\n"
      "  seeds         room parameters of bakes with other seeds, and with four times the "
      "photons\n"
      "  room          a measured room, from its description ROOM.json, beside its measurement\n\n"
      "The figures of the paper are those of assets/levels/stadium_paper.glb baked with "
      "--sources 20000 (16 416 fans, 20 000 reflections) and violin_room.glb with --sources 50000. "
      "violin and octave-bands bake the level in the file again with other materials, seeds with "
      "other seeds.",
      "clamor experiment stadium stadium.clamor -o report");
  parser.positional("experiment", name,
                    "stadium, violin, octave-bands, convergence, walk, field, motion, probes, "
                    "seeds or room");
  parser.positional("bake", options.level, "the bake file; for room, the description");
  parser.option("-o,--output", folder, "folder to write to");
  parser.required("-o");
  add_options(parser, options, listener);
  QuietOption quiet(parser);
  std::vector<std::string> names;
  for (const auto& [known, experiment] : kExperiments) names.emplace_back(known);
  parser.words("experiment", names);
  if (const auto code = parser.parse(arguments, out, err)) return *code;

  Experiment* run = nullptr;
  for (const Known& known : kExperiments)
    if (known.name == name) run = known.run;
  if (run == nullptr)
    return parser.bad_usage(err, "there is no experiment " + in_quotes(name) + "; the nearest is " +
                                     in_quotes(nearest_name(name, names)));
  if (listener) {
    options.listener_m = listener->position_m;
    // Experiments know nothing of the level's origin, which all that they read is relative to.
    if (const auto file = BakeFile::open(options.level); file.ok())
      *options.listener_m -= file->origin_m();
  }
  return parser.end(err, run_and_write(run, name, folder, options, quiet.notes(err)));
}

}  // namespace clamor
