#include "bake/reweighed_photons.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "common/thin_material.h"

namespace clamor {

namespace {

constexpr double kLeastPower = 1e-3;
constexpr double kStretchesPerMean = 2;
constexpr std::size_t kMaxStretches = 4096;
// Before a stretch without deposits the power has decayed at least so far, or paths ended too
// early.
constexpr double kPowerAtEnd = 1e-2;

struct Stretch {
  double sum = 0, squares = 0;
  double effective() const { return squares > 0 ? sum * sum / squares : 0; }
};

bool decays_in_steps(const std::vector<Stretch>& stretches, double least) {
  double loudest = 0;
  for (const Stretch& stretch : stretches) loudest = std::max(loudest, stretch.sum);
  bool is_after_loudest = false;
  double last = 0;
  for (const Stretch& stretch : stretches) {
    is_after_loudest = is_after_loudest || stretch.sum >= loudest;
    if (!is_after_loudest) continue;
    if (stretch.sum > 0 && stretch.sum < kLeastPower * loudest) return true;
    if (!(stretch.sum > 0)) break;
    if (stretch.effective() < least) return false;
    last = stretch.sum;
  }
  return last <= kPowerAtEnd * loudest;
}

}  // namespace

Result<std::vector<Bands>> reweighing_ratios(std::span<const Material> old_materials,
                                             std::span<const Material> new_materials) {
  std::vector<Bands> ratios(new_materials.size(), same_in_all_bands(1));
  for (std::size_t m = 0; m < ratios.size(); ++m) {
    const Material& before = old_materials[m];
    const Material& after = new_materials[m];
    if (before.absorption == after.absorption) continue;
    if (is_thin(before)) return Error(in_quotes(after.name) + " lets sound through");
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float old_share = 1 - before.absorption[b], new_share = 1 - after.absorption[b];
      if (!(old_share > 0) && new_share > 0)
        return Error(in_quotes(after.name) + " has reflected nothing so far");
      ratios[m][b] = old_share > 0 ? new_share / old_share : 0;
    }
  }
  return ratios;
}

bool enough_deposits(std::span<const TracedRuns> runs, std::span<const double> photon_shares,
                     double least) {
  std::array<double, kBandCount> sums{}, moments{}, per_s{};
  for (const TracedRuns& run : runs)
    for (const Deposit& deposit : run.deposits())
      for (std::size_t b = 0; b < kBandCount; ++b) {
        const double power = deposit.power[b] * photon_shares[deposit.emitter];
        sums[b] += power;
        moments[b] += power * static_cast<double>(deposit.delay_s);
      }
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (moments[b] > 0) per_s[b] = kStretchesPerMean * sums[b] / moments[b];

  std::array<std::vector<Stretch>, kBandCount> stretches;
  for (const TracedRuns& run : runs)
    for (const Deposit& deposit : run.deposits())
      for (std::size_t b = 0; b < kBandCount; ++b) {
        const double power = deposit.power[b] * photon_shares[deposit.emitter];
        const auto at = static_cast<std::size_t>(
            std::min(static_cast<double>(deposit.delay_s) * per_s[b], double{kMaxStretches}));
        if (at >= stretches[b].size()) stretches[b].resize(at + 1);
        stretches[b][at].sum += power;
        stretches[b][at].squares += power * power;
      }
  return std::ranges::all_of(stretches, [&](const std::vector<Stretch>& of_band) {
    return decays_in_steps(of_band, least);
  });
}

Result<bool> ReweighedPhotons::find(const PhotonRun& run, TracedRuns& found) {
  assert(next_ < runs_.size());
  const TracedRuns& photons = runs_[next_++];
  const TracedRun& only = photons.runs().front();
  assert(only.run.emitter == run.emitter && only.run.first == run.first);
  found.append(run, only.tally, photons.deposits(), only.arrived);
  return true;
}

}  // namespace clamor
