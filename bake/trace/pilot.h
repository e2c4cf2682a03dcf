// pilot.h: a few photons traced ahead of a bake, to plan it.
#pragma once

#include <optional>
#include <vector>

#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "bake/trace/weight_window.h"

namespace clamor {

struct Level;

struct Pilot {
  struct PilotDeposit {
    double path_m = 0;
    double share = 0;  // power, relative to its photon's
  };
  std::vector<PilotDeposit> deposits;
  DecayModel decay;

  double deposits_per_photon() const;

  // The threshold of TraceSettings for which `photons` leave about `wanted` deposits whose path is
  // longer than `from_m`; 0 if they leave no more anyway. Rounded down to a power of two, so that
  // it stays the same as emitters move a little.
  double threshold(double photons, double wanted, double from_m = 0) const;
};

// Traces 1024 photons, shared among the emitters by their power. Their seed differs from the
// bake's, so that the plan is independent of the paths that it is used for.
Pilot trace_pilot(const Scene& scene, const Level& level, const TraceSettings& trace);

}  // namespace clamor
