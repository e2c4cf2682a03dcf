// experiments.h: what `clamor experiment` can find out, each in a file of its own.
#pragma once

#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "common/vec.h"
#include "tools/analysis/report_page.h"
#include "tools/experiments/experiment_scene.h"

namespace clamor {

struct ExperimentOptions {
  std::string level;
  std::optional<Vec3> listener_m;  // unset: ExperimentScene::default_listener_m()
  double seconds = 1;              // of sound per rendering
  double minutes = 10;             // at each speed
  int readings = 60;               // of loudness, at each speed
  int voices = 2000;               // who moves hears so many
  int seeds = 100;                 // drawings per strategy and k, where nothing is rendered
  int rolls = 19;                  // exact renderings with other phases
  bool quick = false;              // few sources, few k: does everything still run?
};

// Say on `err` how far they are.
using Experiment = Result<ReportPage> (*)(const ExperimentOptions&, std::ostream& err);
Result<ReportPage> stadium_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> violin_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> octave_bands_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> convergence_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> walk_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> motion_experiment(const ExperimentOptions& options, std::ostream& err);

// Part of motion: what a keyframe takes, against what it depends on.
Result<ReportTable> keyframe_times(const ExperimentOptions& options, std::ostream& err);

// 0 of none.
double quantile(std::vector<double> values, double share);

// Where the best of the paper's strategies is nearer to all sources than ours.
struct WorseThanPaper {
  std::size_t k = 0;
  double ours = 0, theirs = 0;  // errors
};

// "at every k", or "at every k but 128 (0.92, the best of the paper's 0.87) and 512 (...)".
std::string at_every_k_except(std::span<const WorseThanPaper> defeats);

// What the reports say of their tables. Every number and every comparison is computed from the
// rows.
std::string figure_4_text(const ReportTable& table);
std::string figure_6_text(const ReportTable& table);
std::string bands_text(const ReportTable& table);
std::string walk_text(const ReportTable& table);
std::string convergence_text(const ReportTable& table);

// The values of a column in those rows whose first cell is `name`, in order; of all rows for "".
std::vector<double> column_of(const ReportTable& table, const std::string& column,
                              const std::string& name = "");

// "1.2 to 3.4", or "1.2" where they are alike in so many digits.
std::string range_text(const std::vector<double>& values, int digits);

// "a", "a and b", "a, b and c".
std::string listed(const std::vector<std::string>& names);

// The exponent e of y = c x^e by least squares of the logarithms; nothing of fewer than two
// points, or where a value is not above zero.
std::optional<double> fitted_exponent(const std::vector<double>& x, const std::vector<double>& y);

// In the palette of charts, the same in all of them.
int colour_of(const std::string& strategy);

inline constexpr std::size_t kQuickSources = 400;

// 32, 64, ... as far as there are twice as many sources, and no farther than `most`.
std::vector<std::size_t> sample_sizes(const ExperimentScene& scene, std::size_t most);

}  // namespace clamor
