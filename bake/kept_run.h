// kept_run.h: a traced run with its paths, and its re-weighing for other absorption.
//
// The directions of photons do not depend on absorption. If only absorption has changed, a path
// that has met materials 1, 2, ... n_1, n_2, ... times carries, in each band, the power
//
//     new power = old power * product over materials m of ((1 - new a_m) / (1 - old a_m)) ^ n_m.
//
// Russian roulette, splitting and thinning stay as they were traced: their probabilities are part
// of the old powers and nothing has to be drawn again. The estimate is unbiased wherever the old
// reflectance is above zero. (Correlated sampling: H. Kahn. Use of Different Monte Carlo Sampling
// Techniques. Symposium on Monte Carlo Methods, 1956.)
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake/trace/photon_tracer.h"
#include "common/bands.h"

namespace clamor {

struct KeptRun {
  PhotonRun run;
  TraceTally tally;
  std::vector<ArrivedPower> arrived;
  std::vector<Deposit> deposits;
  PathRecord paths;  // of this run; hits that lead to no power are left out

  std::uint64_t bytes() const;

  // The run in a level of other absorption. `ratios` has, by material, the factor of the power of a
  // path that meets it once. Deposits without power are left out. The power that arrives at a
  // material changes as that of its deposits does, before they are reflected.
  TracedRuns reweighed(std::span<const Bands> ratios) const;
};

// Copies runs whose paths are recorded.
std::vector<KeptRun> kept_runs(const TracedRuns& traced);

}  // namespace clamor
