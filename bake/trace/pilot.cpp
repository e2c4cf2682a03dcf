#include "bake/trace/pilot.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/maths.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr std::uint32_t kPilotPhotons = 1024;

double power_of_two_down(double value) {
  return value > 0 ? exp2_of(std::floor(log2_of(value))) : 0;
}

// The T for which the sum of min(1, root / T), times `per_root`, equals `wanted`. `roots` ascend.
double root_threshold(const std::vector<double>& roots, double per_root, double wanted) {
  // For T equal to a root, smaller ones are thinned and larger ones are kept.
  double below = 0;
  for (std::size_t i = 0; i < roots.size(); ++i) {
    const double above = static_cast<double>(roots.size() - i);
    if (per_root * (below / roots[i] + above) <= wanted) {
      // T lies between the previous root and this one: below / T + above = wanted / per_root.
      const double room = wanted / per_root - above;
      return room > 0 ? std::min(below / room, roots[i]) : roots[i];
    }
    below += roots[i];
  }
  return below / (wanted / per_root);
}

}  // namespace

double Pilot::deposits_per_photon() const {
  return static_cast<double>(deposits.size()) / kPilotPhotons;
}

double Pilot::threshold(double photons, double wanted, double from_m) const {
  std::vector<double> roots;
  for (const PilotDeposit& deposit : deposits)
    if (deposit.path_m >= from_m) roots.push_back(std::sqrt(std::sqrt(deposit.share)));
  const double per_root = photons / kPilotPhotons;
  if (!(wanted > 0) || static_cast<double>(roots.size()) * per_root <= wanted) return 0;
  std::sort(roots.begin(), roots.end());
  const double root = root_threshold(roots, per_root, wanted);
  return power_of_two_down(root * root * root * root);
}

Pilot trace_pilot(const Scene& scene, const Level& level, const TraceSettings& trace) {
  std::vector<double> power;
  for (const Emitter& emitter : level.emitters) power.push_back(emitted_power(emitter));
  const double total = std::accumulate(power.begin(), power.end(), 0.0);

  TraceSettings settings = trace;
  settings.seed = trace.seed ^ 0x70696c6f74u;
  settings.deposit_threshold = settings.early_until_m = 0;
  settings.decay = {};
  std::vector<PhotonRun> runs;
  double below = 0;
  for (std::uint32_t i = 0; i < power.size() && total > 0; ++i) {
    // Systematic sampling: photon k belongs to the emitter at (k + 1/2) / n of the power.
    const auto first = static_cast<std::int64_t>(std::ceil(below / total * kPilotPhotons - 0.5));
    below += power[i];
    const auto last = static_cast<std::int64_t>(std::ceil(below / total * kPilotPhotons - 0.5));
    if (last > first) runs.push_back({i, 0, static_cast<std::uint32_t>(last - first)});
  }
  Pilot pilot;
  TracedRuns traced;
  PhotonTracer(scene, level, settings).trace(runs, traced);
  pilot.decay = decay_model(traced.deposits(), trace.speed_mps);
  // Weight windows change how many deposits a photon leaves.
  traced.clear();
  settings.decay = pilot.decay;
  PhotonTracer(scene, level, settings).trace(runs, traced);
  for (const Deposit& deposit : traced.deposits())
    pilot.deposits.push_back({static_cast<double>(deposit.delay_s) * trace.speed_mps,
                              sum_of(deposit.power) / power[deposit.emitter]});
  return pilot;
}

}  // namespace clamor
