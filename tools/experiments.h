// experiments.h: what `clamor experiment` can find out, each in a file of its own.
#pragma once

#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "common/vec.h"
#include "tools/experiment_report.h"
#include "tools/experiment_scene.h"

namespace clamor {

struct ExperimentOptions {
  std::string level;
  std::optional<Vec3> listener_m;  // unset: ExperimentScene::usual_place()
  double seconds = 1;              // of sound per rendering
  double minutes = 10;             // at each speed
  int readings = 60;               // of loudness, at each speed
  int voices = 2000;               // who moves hears so many
  int seeds = 100;                 // drawings per strategy and k, where nothing is rendered
  int rolls = 19;                  // exact renderings with other phases
  bool quick = false;              // few sources, few k: does everything still run?
};

// Say on `err` how far they are.
using Experiment = Result<ExperimentReport> (*)(const ExperimentOptions&, std::ostream& err);
Result<ExperimentReport> stadium_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ExperimentReport> violin_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ExperimentReport> octave_bands_experiment(const ExperimentOptions& options,
                                                 std::ostream& err);
Result<ExperimentReport> convergence_experiment(const ExperimentOptions& options,
                                                std::ostream& err);
Result<ExperimentReport> walk_experiment(const ExperimentOptions& options, std::ostream& err);
Result<ExperimentReport> motion_experiment(const ExperimentOptions& options, std::ostream& err);

// Part of motion: what a keyframe takes, against what it depends on.
Result<ReportTable> keyframe_times(const ExperimentOptions& options, std::ostream& err);

// 0 of none.
double quantile(std::vector<double> values, double share);

// Where the best of the paper's strategies is nearer to all sources than ours.
struct Defeat {
  std::size_t k = 0;
  double ours = 0, theirs = 0;  // errors
};

// "at every k", or "at every k but 128 (0.92, the best of the paper's 0.87) and 512 (...)".
std::string at_every_k_but(std::span<const Defeat> defeats);

// In the palette of charts, the same in all of them.
int colour_of(const std::string& strategy);

inline constexpr std::size_t kQuickSources = 400;

// 32, 64, ... as far as there are twice as many sources, and no farther than `most`.
std::vector<std::size_t> sample_sizes(const ExperimentScene& scene, std::size_t most);

}  // namespace clamor
