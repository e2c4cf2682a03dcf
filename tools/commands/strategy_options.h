// strategy_options.h: --strategy, --voices, --estimator and what tunes them, alike in all commands.
#pragma once

#include <string>

#include "common/result.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "tools/program/arguments.h"
#include "tools/strategies/strategies.h"

namespace clamor {

// The words of the command line, until read() has made sense of them.
class StrategyArguments {
 public:
  explicit StrategyArguments(Arguments& parser, const std::string& usual = "priority");

  // After parse(); the Error is what the user got wrong.
  Result<StrategyOptions> read() const;

 private:
  std::string strategy_, estimator_ = "power";
  int voices_ = 2000;
  StrategyTuning tuning_;
};

// Has the auralizer choose so.
void use(const StrategyOptions& strategy, AuralizerOptions& options);

}  // namespace clamor
