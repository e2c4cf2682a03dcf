// bake_until.h: bakes until the decay is known to a given error or a time limit is reached.
//
// The error depends on both photons and sources: with 200 000 sources in the violin room it stays
// between 0.41 and 0.51 dB from 20 000 photons to 400 000. Both therefore grow together, in rounds.
// The first round is small, and each further one is scaled by the measured error or speed. Photons
// are sequences that a larger round only extends, and a constant ratio of photons to sources keeps
// the thinning threshold constant. With a journal, no round traces a photon again.
//
// The settings of the result reproduce its bytes in a single bake.
#pragma once

#include <optional>
#include <string>

#include "bake/bake.h"

namespace clamor {

struct BakeGoal {
  double error_db = 0;  // target error of the energy decay (DecaySummary::error_db); 0: none
  double seconds = 0;   // wall-clock limit for the whole bake; 0: none

  // Parses "0.5dB", "90s", "15min" or "2h".
  static std::optional<BakeGoal> from(const std::string& text);
};

// If the goal is missed, `why_not` explains it in a sentence: the level gives no error estimate, or
// the goal needs more sources than a file holds or more memory than the options allow. The best
// bake so far is returned.
Result<BakeContents> bake_until(const Level& level, const BakeOptions& options,
                                const BakeGoal& goal, BakeReport* report = nullptr,
                                std::string* why_not = nullptr);

}  // namespace clamor
