#include "bake/path_cache.h"

#include <algorithm>
#include <array>
#include <utility>

#include <tbb/parallel_for.h>

#include "bake/closed_state.h"
#include "bake/journal/run_key.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr double kLeastPower = 1e-3;
constexpr double kStretchesPerMean = 2;
constexpr std::size_t kMaxStretches = 4096;
// Before a stretch without deposits the power has decayed at least so far, or paths ended too
// early.
constexpr double kPowerAtEnd = 1e-2;
// A factor beyond it belongs to photons whose power single precision no longer tells from zero.
constexpr float kMaxFactor = 1e30f;

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
    if (before.transmission != Bands{}) return Error(in_quotes(after.name) + " lets sound through");
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float old_share = 1 - before.absorption[b], new_share = 1 - after.absorption[b];
      if (!(old_share > 0) && new_share > 0)
        return Error(in_quotes(after.name) + " has reflected nothing so far");
      ratios[m][b] = old_share > 0 ? new_share / old_share : 0;
    }
  }
  return ratios;
}

bool enough_deposits(std::span<const TracedRuns> batches, std::span<const double> photon_shares,
                     double least) {
  std::array<double, kBandCount> sums{}, moments{}, per_s{};
  for (const TracedRuns& batch : batches)
    for (const Deposit& deposit : batch.deposits())
      for (std::size_t b = 0; b < kBandCount; ++b) {
        const double power = deposit.power[b] * photon_shares[deposit.emitter];
        sums[b] += power;
        moments[b] += power * static_cast<double>(deposit.delay_s);
      }
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (moments[b] > 0) per_s[b] = kStretchesPerMean * sums[b] / moments[b];

  std::array<std::vector<Stretch>, kBandCount> stretches;
  for (const TracedRuns& batch : batches)
    for (const Deposit& deposit : batch.deposits())
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

void PathCache::begin(const Level& level, const BakeSettings& settings, const BakePlan& plan,
                      const TraceSettings& trace) {
  batches_.clear();
  bytes_ = 0;
  key_ = paths_hash(level, settings);
  materials_ = level.materials;
  plan_ = plan;
  images_ = trace.images;
  all_batches_ = has_closed_state(level) ? 0 : plan.batches().size();
}

void PathCache::add(const TracedRuns& batch) {
  if (all_batches_ == 0) return;
  const PathRecord& paths = batch.paths();
  const auto deposits = batch.deposits();
  bytes_ += deposits.size_bytes() + deposits.size() * sizeof(std::uint32_t) +
            paths.nodes.size() * sizeof(PathNode) + paths.tallies.size() * sizeof(PathTally) +
            batch.runs().size() * sizeof(TracedRun);
  if (bytes_ > max_bytes_) {
    batches_ = {};
    bytes_ = all_batches_ = 0;
    return;
  }
  Batch& kept = batches_.emplace_back();
  kept.runs.assign(batch.runs().begin(), batch.runs().end());
  kept.deposits.assign(deposits.begin(), deposits.end());
  kept.paths.nodes = paths.nodes;
  kept.paths.tallies = paths.tallies;
  kept.paths.deposits.assign(paths.deposits.begin(),
                             paths.deposits.begin() + static_cast<std::ptrdiff_t>(deposits.size()));
}

Result<ReweighedPhotons> PathCache::reweigh(const Level& level,
                                            const BakeSettings& settings) const {
  if (all_batches_ == 0 || batches_.size() != all_batches_)
    return Error("no complete bake has kept its paths");
  if (level.materials.size() != materials_.size() || has_closed_state(level) ||
      paths_hash(level, settings) != key_)
    return Error("more than absorption has changed");
  const auto ratios = reweighing_ratios(materials_, level.materials);
  if (!ratios.ok()) return ratios.error();
  ReweighedPhotons result{plan_, images_, std::vector<TracedRuns>(batches_.size())};
  tbb::parallel_for(std::size_t{0}, batches_.size(),
                    [&](std::size_t i) { result.batches[i] = reweigh(batches_[i], *ratios); });
  std::vector<double> photon_shares;
  for (const std::uint64_t photons : plan_.photons)
    photon_shares.push_back(photons > 0 ? 1 / static_cast<double>(photons) : 0);
  if (min_deposits_ > 0 && !enough_deposits(result.batches, photon_shares, min_deposits_))
    return Error("too few of the kept paths carry the new decay");
  return result;
}

TracedRuns PathCache::reweigh(const Batch& batch, std::span<const Bands> ratios) const {
  const auto& nodes = batch.paths.nodes;
  std::vector<Bands> factors(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    factors[i] = ratios[nodes[i].material];
    if (nodes[i].before == PathNode::kNone) continue;
    const Bands& before = factors[nodes[i].before];
    for (std::size_t b = 0; b < kBandCount; ++b)
      factors[i][b] = std::min(factors[i][b] * before[b], kMaxFactor);
  }

  std::vector<TracedRun> runs = batch.runs;
  for (TracedRun& run : runs)
    run.tally.power_escaped = run.tally.power_unfinished = run.tally.power_of_images = {};
  for (const PathTally& power : batch.paths.tallies) {
    TraceTally& tally = runs[power.run].tally;
    std::uint32_t node = power.node;
    if (power.kind == PathTally::Kind::kUnfinished && node != PathNode::kNone)
      node = nodes[node].before;
    auto& sum = power.kind == PathTally::Kind::kEscaped      ? tally.power_escaped
                : power.kind == PathTally::Kind::kUnfinished ? tally.power_unfinished
                                                             : tally.power_of_images;
    for (std::size_t b = 0; b < kBandCount; ++b)
      sum[b] += static_cast<double>(power.power[b]) *
                static_cast<double>(node == PathNode::kNone ? 1.0f : factors[node][b]);
  }

  TracedRuns result;
  std::vector<Deposit> deposits;
  for (const TracedRun& run : runs) {
    deposits.clear();
    for (std::size_t i = run.first_deposit; i < run.first_deposit + run.deposits; ++i) {
      Deposit deposit = batch.deposits[i];
      float loudest = 0;
      for (std::size_t b = 0; b < kBandCount; ++b) {
        deposit.power[b] *= factors[batch.paths.deposits[i]][b];
        loudest = std::max(loudest, deposit.power[b]);
      }
      if (loudest > 0) deposits.push_back(deposit);
    }
    result.append(run.run, run.tally, deposits);
  }
  return result;
}

}  // namespace clamor
