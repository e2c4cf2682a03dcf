// experiment_command.cpp: clamor experiment: the paper's figures and claims, found again.
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <ostream>

#include <fmt/format.h>

#include "common/text.h"
#include "runtime/sampling/strategies.h"
#include "tools/commands/commands.h"
#include "tools/experiments/experiments.h"
#include "tools/program/arguments.h"
#include "tools/program/interrupt.h"
#include "tools/program/progress.h"

namespace clamor {

namespace {

struct Known {
  const char* name;
  Experiment run;
};
constexpr std::array<Known, 6> kExperiments = {{{"stadium", stadium_experiment},
                                                {"violin", violin_experiment},
                                                {"octave-bands", octave_bands_experiment},
                                                {"convergence", convergence_experiment},
                                                {"walk", walk_experiment},
                                                {"motion", motion_experiment}}};

}  // namespace

int run_experiment(std::span<const std::string> arguments, std::ostream& out, std::ostream& err) {
  ExperimentOptions options;
  std::string name, folder, listener;
  Arguments parser(
      "experiment",
      "Runs an experiment of the paper on a bake and writes what it found beside what the paper "
      "says: FOLDER/NAME.html with its pictures in it, and the tables as CSV and JSON.\n\n"
      "  stadium       figures 4 and 5: waveform error and what the ear can tell, against k\n"
      "  violin        figure 6: impulse responses, diffuse and Phong 20, two speeds of sound\n"
      "  octave-bands  Phong exponents that rise with the band; bands apart or together\n"
      "  convergence   loudness and error against k over many seeds; time per keyframe\n"
      "  walk          what is exchanged per metre, and how loud it is meanwhile\n"
      "  motion        ten minutes of walking, running and flying: clicks, loudness, keyframe "
      "times\n\n"
      "The figures of the paper are those of assets/levels/stadium_paper.glb baked with "
      "--sources 20000 (16 416 fans, 20 000 reflections) and violin_room.glb with --sources 50000. "
      "violin and octave-bands bake the level in the file again with other materials.",
      "clamor experiment stadium stadium.clamor -o report");
  parser.positional("experiment", name,
                    "stadium, violin, octave-bands, convergence, walk or motion");
  parser.positional("level", options.level, "the bake file");
  parser.option("-o,--output", folder, "the folder to write to");
  parser.required("-o");
  parser.option("--listener", listener,
                "X,Y,Z in metres; unset: amid the emitters, 4 m before a single one");
  parser.option("--seconds", options.seconds, "stadium: length of each rendering");
  parser.option("--minutes", options.minutes, "motion: at each speed");
  parser.option("--readings", options.readings, {1, 100'000},
                "motion: of momentary loudness against all sources, at each speed");
  parser.option("--voices", options.voices, {1, kMaxVoices}, "motion: chosen at a time");
  parser.option("--seeds", options.seeds, {2, 10000},
                "convergence, walk, octave-bands: drawings per strategy and k");
  parser.option(
      "--rolls", options.rolls, {19, 1000},
      "stadium: exact renderings with other phases, 19 or more; 100 take 5 times as long");
  parser.flag("--quick", options.quick, "few sources and few k, to see that all of it runs");
  if (const auto code = parser.parse(arguments, out, err)) return *code;

  Experiment run = nullptr;
  std::vector<std::string> names;
  for (const Known& known : kExperiments) {
    names.emplace_back(known.name);
    if (known.name == name) run = known.run;
  }
  if (run == nullptr)
    return parser.bad_usage(err, "there is no experiment " + in_quotes(name) + "; the nearest is " +
                                     in_quotes(nearest_name(name, names)));
  if (!listener.empty()) {
    const auto pose = parse_listener(listener);
    if (!pose.ok()) return parser.bad_usage(err, pose.error().message);
    options.listener_m = pose->position_m;
  }
  if (!(options.seconds >= 0.5 && options.seconds <= 60))
    return parser.bad_usage(err, "--seconds must lie between 0.5 and 60");
  if (!(options.minutes >= 0.1 && options.minutes <= 600))
    return parser.bad_usage(err, "--minutes must lie between 0.1 and 600");

  InputFiles inputs;
  inputs.add(options.level);
  if (const auto can = ReportPage::check_folder(folder, name, inputs); !can.ok()) {
    err << "clamor experiment: " << can.error().message << '\n';
    return kBadInput;
  }
  const Progress progress(err, "  " + name);
  const auto report = [&] {
    const ExitOnSignal stop("experiment");
    return run(options, err);
  }();
  if (!report.ok()) {
    err << "clamor experiment: " << report.error().message << '\n';
    return kBadInput;
  }
  const Interrupt until_written;
  if (const auto written = report->write(folder); !written.ok()) {
    err << "clamor experiment: " << written.error().message << '\n';
    return kBadInput;
  }
  err << fmt::format("wrote {0}/{1}.html, {1}.json and {2} tables as CSV in {3}\n", folder, name,
                     report->tables().size(), format_duration(progress.seconds()));
  return kSuccess;
}

std::vector<double> column_of(const ReportTable& table, const std::string& column,
                              const std::string& name) {
  const auto at = static_cast<std::size_t>(
      std::find(table.columns.begin(), table.columns.end(), column) - table.columns.begin());
  assert(at < table.columns.size());
  std::vector<double> values;
  for (const auto& row : table.rows) {
    const auto* first = std::get_if<std::string>(&row[0]);
    if (name.empty() || (first != nullptr && *first == name))
      values.push_back(std::get<double>(row[at]));
  }
  return values;
}

std::string range_text(const std::vector<double>& values, int digits) {
  if (values.empty()) return "nothing";
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const std::string low = fmt::format("{:.{}f}", *least, digits),
                    high = fmt::format("{:.{}f}", *most, digits);
  return low == high ? low : low + " to " + high;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

std::optional<double> fitted_exponent(const std::vector<double>& x, const std::vector<double>& y) {
  assert(x.size() == y.size());
  double sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(x[i] > 0) || !(y[i] > 0)) return std::nullopt;
    const double log_x = std::log(x[i]), log_y = std::log(y[i]);
    sum_x += log_x, sum_y += log_y, sum_xx += log_x * log_x, sum_xy += log_x * log_y;
  }
  const double spread = n * sum_xx - sum_x * sum_x;
  if (x.size() < 2 || !(spread > 1e-12)) return std::nullopt;
  return (n * sum_xy - sum_x * sum_y) / spread;
}

int colour_of(const std::string& strategy) {
  for (std::size_t i = 0; i < kStrategies.size(); ++i)
    if (kStrategies[i].name == strategy) return static_cast<int>(i);
  return Chart::kGrey;
}

}  // namespace clamor
