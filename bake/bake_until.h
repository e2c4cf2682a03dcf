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

// The sizes of a bake that is repeated until its error is small enough.
struct BakeRounds {
  static constexpr int kMost = 8;

  std::uint64_t first_photons = 0, first_sources = 0;
  std::uint64_t times = 1;  // size of this round, relative to the first
  int round = 1;

  static std::uint64_t sources_of_first(const Level& level);

  // Goes on to the next round, for an error of the energy decay, and returns true; or false if the
  // goal is reached or, with a reason, cannot be.
  bool go_on(double error_db, double goal_db, std::string& reason);
};

// If the goal is missed, `why_not` explains it in a sentence: the level gives no error estimate, or
// the goal needs more sources than a file holds or more memory than the options allow. The best
// bake so far is returned.
Result<BakeContents> bake_until(const Level& level, const BakeOptions& options,
                                const BakeGoal& goal, BakeReport* report = nullptr,
                                std::string* why_not = nullptr);

}  // namespace clamor
