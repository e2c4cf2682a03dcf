#include "bake/trace/pilot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/maths.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr std::uint32_t kPilotPhotons = 1024;

// The T for which the sum of min(1, odds / T), times `per_one`, equals `wanted`. `odds` ascend.
double odds_threshold(const std::vector<double>& odds, double per_one, double wanted) {
  // For T equal to one of the odds, smaller ones are thinned and larger ones are kept.
  double below = 0;
  for (std::size_t i = 0; i < odds.size(); ++i) {
    const double above = static_cast<double>(odds.size() - i);
    if (per_one * (below / odds[i] + above) <= wanted) {
      // T lies between the odds before and these: below / T + above = wanted / per_one.
      const double room = wanted / per_one - above;
      return room > 0 ? std::min(below / room, odds[i]) : odds[i];
    }
    below += odds[i];
  }
  return below / (wanted / per_one);
}

// The photons of a pilot, as runs of at most `at_once` of them.
std::vector<PhotonRun> pilot_runs(std::span<const double> power, std::uint32_t at_once) {
  const double total = std::accumulate(power.begin(), power.end(), 0.0);
  std::vector<PhotonRun> runs;
  double below = 0;
  for (std::uint32_t i = 0; i < power.size() && total > 0; ++i) {
    // Systematic sampling: photon k belongs to the emitter at (k + 1/2) / n of the power.
    const auto first = static_cast<std::int64_t>(std::ceil(below / total * kPilotPhotons - 0.5));
    below += power[i];
    const auto last = static_cast<std::int64_t>(std::ceil(below / total * kPilotPhotons - 0.5));
    const auto count = static_cast<std::uint32_t>(last - first);
    for (std::uint32_t begin = 0; begin < count; begin += at_once)
      runs.push_back({i, begin, std::min(at_once, count - begin)});
  }
  return runs;
}

std::vector<double> powers_of(const Level& level) {
  std::vector<double> power;
  for (const Emitter& emitter : level.emitters) power.push_back(emitted_power(emitter));
  return power;
}

TraceSettings pilot_settings(const TraceSettings& trace, const DecayModel& decay) {
  TraceSettings settings = trace;
  settings.seed = trace.seed ^ 0x70696c6f74u;
  settings.deposit_threshold = settings.early_until_m = settings.fade_s = 0;
  settings.decay = decay;
  return settings;
}

void append_deposits(std::span<const Deposit> deposits, std::span<const double> power,
                     double speed_mps, Pilot& pilot) {
  const DepositWeight weight(pilot.decay);
  for (const Deposit& deposit : deposits) {
    const double path_m = static_cast<double>(deposit.delay_s) * speed_mps;
    const double share = static_cast<double>(weight.of(deposit.power, static_cast<float>(path_m))) /
                         power[deposit.emitter];
    pilot.deposits.push_back({path_m, share});
  }
}

}  // namespace

double Pilot::deposits_per_photon() const {
  return static_cast<double>(deposits.size()) / kPilotPhotons;
}

double Pilot::threshold(double photons, double wanted, double from_m) const {
  std::vector<double> odds;
  for (const PilotDeposit& deposit : deposits)
    if (deposit.path_m >= from_m) odds.push_back(odds_of(deposit.weight));
  const double per_one = photons / kPilotPhotons;
  if (!(wanted > 0) || static_cast<double>(odds.size()) * per_one <= wanted) return 0;
  std::sort(odds.begin(), odds.end());
  const double least = odds_threshold(odds, per_one, wanted);
  // A deposit at the threshold has the weight least^(4/3).
  return least > 0 ? exp2_of(std::floor(4 * log2_of(least)) / 3) : 0;
}

// With energies E1 to E4 of the four quarters of the longest path, E4 / (E3 / E4 - 1) follows
// beyond it, and a band has lost 60 dB when 1e-6 of the energy is left.
double decay_path_m(std::span<const TracedRuns> runs, std::span<const double> photon_shares,
                    double longest_path_m, double speed_mps) {
  constexpr double kLeft = 1e-6;
  const double quarter_m = longest_path_m / 4;
  std::array<std::array<double, 4>, kBandCount> energies{};
  for (const TracedRuns& some : runs)
    for (const Deposit& deposit : some.deposits()) {
      const double quarters = static_cast<double>(deposit.delay_s) * speed_mps / quarter_m;
      const auto at = static_cast<std::size_t>(std::clamp(quarters, 0.0, 3.0));
      for (std::size_t b = 0; b < kBandCount; ++b)
        energies[b][at] += static_cast<double>(deposit.power[b]) * photon_shares[deposit.emitter];
    }
  double needed_m = 0;
  for (const auto& energy : energies) {
    const double total = std::accumulate(energy.begin(), energy.end(), 0.0);
    if (!(energy[3] > kLeft * total)) continue;
    if (!(energy[2] > energy[3])) return std::numeric_limits<double>::infinity();
    const double ratio = energy[2] / energy[3], rest = energy[3] / (ratio - 1);
    const double quarters = log2_of(rest / (kLeft * (total + rest))) / log2_of(ratio);
    if (quarters > 0) needed_m = std::max(needed_m, longest_path_m + quarters * quarter_m);
  }
  return needed_m;
}

Pilot trace_pilot(const Scene& scene, const Level& level, const TraceSettings& trace) {
  const std::vector<double> power = powers_of(level);
  const std::vector<PhotonRun> runs = pilot_runs(power, kPilotPhotons);
  Pilot pilot;
  TracedRuns traced;
  TraceSettings of_all_sound = pilot_settings(trace, {});
  of_all_sound.images = nullptr;
  PhotonTracer(scene, level, of_all_sound).trace(runs, traced);
  pilot.decay = decay_model(traced.deposits(), trace.speed_mps);
  pilot.decay_path_m = decay_path_m({&traced, 1}, std::vector<double>(power.size(), 1.0),
                                    trace.longest_path_s * trace.speed_mps, trace.speed_mps);
  // Weight windows change how many deposits a photon leaves, and images how strong they are.
  traced.clear();
  PhotonTracer(scene, level, pilot_settings(trace, pilot.decay)).trace(runs, traced);
  append_deposits(traced.deposits(), power, trace.speed_mps, pilot);
  return pilot;
}

void lengthen_pilot(const Scene& scene, const Level& level, const TraceSettings& trace,
                    Pilot& pilot) {
  // In a small, hard room a photon leaves up to 10 000 deposits, so few photons are traced at once.
  constexpr std::uint32_t kAtOnce = 128;
  const std::vector<double> power = powers_of(level);
  const PhotonTracer tracer(scene, level, pilot_settings(trace, pilot.decay));
  pilot.deposits.clear();
  TracedRuns traced;
  for (const PhotonRun& run : pilot_runs(power, kAtOnce)) {
    traced.clear();
    tracer.trace({&run, 1}, traced);
    append_deposits(traced.deposits(), power, trace.speed_mps, pilot);
  }
}

}  // namespace clamor
