// pilot.h: a few photons traced ahead of a bake, to plan it.
#pragma once

#include <span>
#include <vector>

#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "bake/trace/weight_window.h"

namespace clamor {

struct Level;

struct Pilot {
  struct PilotDeposit {
    double path_m = 0;
    double weight = 0;  // relative to the initial power of its photon
  };
  std::vector<PilotDeposit> deposits;
  DecayModel decay;
  double decay_path_m = 0;  // see decay_path_m()

  double deposits_per_photon() const;

  // The threshold of TraceSettings for which `photons` leave about `wanted` deposits whose path is
  // longer than `from_m`; 0 if they leave no more anyway. Rounded down to a power of
  // kThresholdStep, so that it stays the same as emitters move a little.
  static constexpr double kThresholdStep = 1.2599210498948732;  // 2^(1/3)
  double threshold(double photons, double wanted, double from_m = 0) const;
};

// Path after which the slowest band has lost 60 dB, if that is longer than the longest path that
// was traced; else 0. Extrapolated by the decay in its last half, so that it does not depend on the
// longest path; infinite if nothing decays. `photon_shares`: weights of deposits, by emitter.
double decay_path_m(std::span<const TracedRuns> runs, std::span<const double> photon_shares,
                    double longest_path_m, double speed_mps);

// Traces 1024 photons, shared among the emitters by their power. Their seed differs from the
// bake's, so that the plan is independent of the paths that it is used for.
Pilot trace_pilot(const Scene& scene, const Level& level, const TraceSettings& trace);

// Replaces the deposits of a pilot by those of longer paths.
void lengthen_pilot(const Scene& scene, const Level& level, const TraceSettings& trace,
                    Pilot& pilot);

}  // namespace clamor
