// experiments.h: the experiments of `clamor experiment`, each in its own file.
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

class OcclusionGeometry;

struct ExperimentOptions {
  std::string level;
  std::optional<Vec3> listener_m;  // unset: ExperimentScene::default_listener_m()
  double seconds = 1;              // duration of each rendering
  double minutes = 10;             // duration at each speed
  int readings = 60;               // readings of loudness, at each speed
  int voices = 2000;               // k while moving
  int seeds = 100;                 // samples per strategy and k, if nothing is rendered
  int bakes = 6;                   // with other seeds
  int rolls = 19;                  // number of exact renderings with other phases
  bool quick = false;              // few sources and few k: a smoke test
};

// Experiments print their progress to `err`.
using Experiment = Result<ReportPage> (*)(const ExperimentOptions&, std::ostream& err);
Result<ReportPage> stadium_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> violin_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> octave_bands_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> convergence_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> walk_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> probes_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> seeds_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ReportPage> motion_experiment(const ExperimentOptions& options, std::ostream& err);

// Part of the motion experiment: time per keyframe.
Result<ReportTable> keyframe_times(const ExperimentOptions& options, std::ostream& err);

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

// Returns "1.2 to 3.4", or "1.2" if both round to that.
std::string range_text(const std::vector<double>& values, int digits);

// Returns "a", "a and b" or "a, b and c".
std::string listed(const std::vector<std::string>& names);

// Exponent e of y = c x^e, fitted to the logarithms by least squares; nothing for fewer than two
// points or if a value is not positive.
std::optional<double> fitted_exponent(const std::vector<double>& x, const std::vector<double>& y);

// Colour of a strategy, the same in all charts.
int colour_of(const std::string& strategy);

inline constexpr std::size_t kQuickSources = 400;

// The values 32, 64, ... up to half the number of sources and up to `max_k`.
std::vector<std::size_t> sample_sizes(const ExperimentScene& scene, std::size_t max_k);

}  // namespace clamor
