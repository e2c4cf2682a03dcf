// stadium_perception.h: the paper's figure 5: audible differences between a sample and all sources.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "tools/experiments/experiments.h"

namespace clamor {

// A strategy with its parameters.
struct SamplingChoice {
  std::string strategy;
  Estimator estimator = Estimator::kAmplitude;
  std::size_t k = 0;
};

// Renders samples of these sizes and as many exact renderings with other phases as `rolls`, and
// adds the figure to the report. `all` is the sound of all sources.
void perception(const ExperimentScene& scene, const Walk& here, double seconds, const Sound& all,
                const std::vector<std::size_t>& sizes, int rolls, ReportPage& report,
                std::ostream& err);

}  // namespace clamor
