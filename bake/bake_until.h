// bake_until.h: a bake that ends at a wanted error or after a wanted time.
//
// What limits a bake is both how many photons there are and how many sources are kept of them: with
// the sources fixed, the error of the decay stops falling (violin room, 200 000 sources: 0.41 to
// 0.51 dB from 20 000 photons to 400 000). So both grow together, and the bake is done in rounds: a
// small one first, the next as many times as large as its error or its speed foretells. Photons are
// sequences of which a larger round only traces more, and as photons and sources keep their ratio
// so does what is thinned while tracing: with a journal no round traces anything twice.
//
// Settings of the result are those of a bake of that size, which makes the same bytes.
#pragma once

#include <optional>
#include <string>

#include "bake/bake.h"

namespace clamor {

struct BakeGoal {
  double error_db = 0;  // of the energy decay (DecaySummary::error_db); or 0
  double seconds = 0;   // of the clock, for the whole bake; or 0

  // "0.5dB", "90s", "15min" or "2h".
  static std::optional<BakeGoal> from(const std::string& text);
};

// `why_not`: a sentence if the goal was missed: where the level tells no error, where it would take
// more sources than a file holds or more memory than options allow. The best bake is returned then.
Result<BakeContents> bake_until(const Level& level, const BakeOptions& options,
                                const BakeGoal& goal, BakeReport* report = nullptr,
                                std::string* why_not = nullptr);

}  // namespace clamor
