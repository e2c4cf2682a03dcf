// experiments.h: the experiments of `clamor experiment`, each in its own file, and what their
// tables, charts and words have in common.
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <iosfwd>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/bands.h"
#include "common/result.h"
#include "common/vec.h"
#include "tools/analysis/report_page.h"
#include "tools/strategies/strategies.h"

namespace clamor {

class ExperimentScene;
class OcclusionGeometry;
struct Sound;

struct ExperimentOptions {
  std::string level;               // bake file, or description of a measured room
  std::optional<Vec3> listener_m;  // unset: ExperimentScene::default_listener_m()
  double seconds = 1;              // duration of each rendering
  double minutes = 10;             // duration at each speed
  int readings = 60;               // readings of loudness, at each speed
  int voices = 2000;               // k while moving
  int seeds = 100;                 // samples per strategy and k, if nothing is rendered
  int bakes = 6;                   // with other seeds
  int rolls = 19;                  // number of exact renderings with other phases
  bool quick = false;              // few sources and few k: a smoke test

  Result<std::unique_ptr<ExperimentScene>> open_scene() const;
  Vec3 place_in(const ExperimentScene& scene) const;
};

// Experiments print their progress to `err`.
using Experiment = Result<ReportPage>(const ExperimentOptions& options, std::ostream& err);
Experiment stadium_experiment, violin_experiment, octave_bands_experiment, convergence_experiment,
    walk_experiment, field_experiment, probes_experiment, seeds_experiment, motion_experiment,
    room_experiment;

// Part of the motion experiment: time per keyframe.
Result<ReportTable> keyframe_times(const ExperimentOptions& options, std::ostream& err);

// Part of the stadium experiment, the paper's figure 5: renders samples of these sizes and as many
// exact renderings with other phases as options.rolls. `all` is the sound of all sources.
void perception(const ExperimentScene& scene, const ExperimentOptions& options, double seconds,
                const Sound& all, const std::vector<std::size_t>& sizes, ReportPage& report,
                std::ostream& err);

// Whether no surface is nearer to a place than this, in some directions.
bool is_clear(const OcclusionGeometry& surfaces, const Vec3& place_m, double clearance_m);

// Returns 0 for no values.
double quantile(std::vector<double> values, double share);

// A sample size at which the best of the paper's strategies has a smaller error than priority
// sampling.
struct WorseThanPaper {
  std::size_t k = 0;
  double ours = 0, theirs = 0;  // relative errors
};

// Returns "at every k", or "at every k but 128 (0.92, the best of the paper's 0.87) and 512 (...)".
std::string at_every_k_except(std::span<const WorseThanPaper> worse);

// Conclusions of the reports. Every number and every comparison is computed from the rows.
std::string figure_4_text(const ReportTable& table);
std::string figure_6_text(const ReportTable& table);
std::string bands_text(const ReportTable& table);
std::string walk_text(const ReportTable& table);
std::string convergence_text(const ReportTable& table);

// Values of a column in the rows whose first cell is `name`, in order; "" means all rows.
std::vector<double> column_of(const ReportTable& table, const std::string& column,
                              const std::string& name = "");

// Words of the first cell of each row, each once.
std::vector<std::string> names_of(const ReportTable& table);

// The rows that have that value in a column.
ReportTable rows_with(ReportTable table, const std::string& column, const ReportTable::Cell& value);

// Names of columns, followed by those of the octaves `lowest` to `highest`, as in "1000_hz".
std::vector<std::string> octave_columns(std::vector<std::string> first, std::size_t lowest = 0,
                                        std::size_t highest = kBandCount - 1);

// Adds a series to the chart for each name in the first column: column y over column x. Points that
// are not above `least` are left out; returns the names that are left with none, which are not
// drawn.
std::vector<std::string> plot(Chart& chart, const ReportTable& table, const std::string& x,
                              const std::string& y, double least = -HUGE_VAL);

// Adds a dashed grey curve through these places.
void plot_curve(Chart& chart, const std::string& name, const std::vector<double>& xs,
                const std::function<double(double)>& y);

// Returns "1.2 to 3.4", or "1.2" if both round to that.
std::string range_text(const std::vector<double>& values, int digits);

// Returns "a", "a and b" or "a, b and c".
std::string listed(const std::vector<std::string>& names);

// Returns " Left out, because they WHY: a and b.", or "" without names.
std::string left_out_text(const std::vector<std::string>& names, const std::string& why);

// Exponent e of y = c x^e, fitted to the logarithms by least squares; nothing for fewer than two
// points or if a value is not positive.
std::optional<double> fitted_exponent(const std::vector<double>& x, const std::vector<double>& y);

// Mean over all values.
double mean_of(const std::vector<double>& values);

// Mean and standard deviation, which is 0 for a single value; nothing for no values.
struct Spread {
  double mean = 0, deviation = 0;
};
std::optional<Spread> spread_of(const std::vector<double>& values);

// `part` in decibels relative to `whole`; -20 for nothing.
double level_db(double part, double whole);

// Colour of a strategy, the same in all charts.
int colour_of(const std::string& strategy);

// The estimator with which a strategy is compared: the paper's scale amplitudes, priority powers.
inline Estimator estimator_of(const std::string& strategy) {
  return strategy == "priority" ? Estimator::kPower : Estimator::kAmplitude;
}
inline const char* name_of(Estimator estimator) {
  return estimator == Estimator::kPower ? "power" : "amplitude";
}

inline constexpr std::size_t kQuickSources = 400;

// The values 32, 64, ... up to half the number of sources and up to `max_k`.
std::vector<std::size_t> sample_sizes(const ExperimentScene& scene, std::size_t max_k);

}  // namespace clamor
