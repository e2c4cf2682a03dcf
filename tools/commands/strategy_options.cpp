#include "tools/commands/strategy_options.h"

#include <fmt/format.h>

#include "runtime/engine/auralizer_options.h"
#include "tools/strategies/strategies.h"

namespace clamor {

StrategyArguments::StrategyArguments(Arguments& parser, const std::string& usual)
    : strategy_(usual) {
  std::string names;
  for (const StrategyInfo& info : kStrategies)
    if (*info.section != '\0')
      names += fmt::format("{}{} ({})", names.empty() ? "" : ", ", info.name, info.section);
  parser.option("--strategy", strategy_,
                "how sources are chosen: priority; all (no sampling); or one of the paper's "
                "strategies, with its section: " +
                    names);
  std::vector<std::string> strategies;
  for (const StrategyInfo& info : kStrategies) strategies.emplace_back(info.name);
  parser.words("--strategy", std::move(strategies));
  parser.option("--voices", voices_, {1, kMaxVoices}, "number of sources to choose (k)");
  parser.option(
      "--estimator", estimator_,
      "which sum is unbiased: power; or amplitude, as in the paper, which is too loud with "
      "few voices");
  parser.words("--estimator", {"power", "amplitude"});
  parser.option("--strategy-seed", tuning_.seed, "seed of the paper's strategies");
  parser.option("--redraw", tuning_.redraw_s, "full-resampling: seconds between samples");
  parser.option("--exchange", tuning_.exchange_per_s,
                "stochastic-diffusion: share of the sample exchanged per second (q)");
  parser.option(
      "--epsilon", tuning_.epsilon,
      "adaptive-diffusion: change of weight, as a factor, at which a source is exchanged");
  parser.option("--candidates", tuning_.candidates_per_voice,
                "octree-diffusion: candidates per voice that the octree returns");
}

Result<StrategyOptions> StrategyArguments::read() const {
  if (estimator_ != "power" && estimator_ != "amplitude")
    return Error("--estimator must be power or amplitude, not " + in_quotes(estimator_) + ".");
  const StrategyOptions options{strategy_, static_cast<std::size_t>(voices_),
                                estimator_ == "power" ? Estimator::kPower : Estimator::kAmplitude,
                                tuning_};
  if (const auto right = check(options); !right.ok()) return right.error();
  return options;
}

void use(const StrategyOptions& strategy, AuralizerOptions& options) {
  options.strategy = make_strategy(strategy);
  options.voices = static_cast<int>(strategy.voices);
}

}  // namespace clamor
