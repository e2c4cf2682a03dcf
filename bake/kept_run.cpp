#include "bake/kept_run.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace clamor {

namespace {

// A factor beyond it belongs to photons whose power single precision no longer tells from zero.
constexpr float kMaxFactor = 1e30f;

// By node, the product of the ratios on the path to it.
std::vector<Bands> factors_of(std::span<const PathNode> nodes, std::span<const Bands> ratios) {
  std::vector<Bands> factors(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    factors[i] = ratios[nodes[i].material];
    if (nodes[i].before == PathNode::kNone) continue;
    const Bands& before = factors[nodes[i].before];
    for (std::size_t b = 0; b < kBandCount; ++b)
      factors[i][b] = std::min(factors[i][b] * before[b], kMaxFactor);
  }
  return factors;
}

// By node, the run that has a power there or after it, or kNone.
std::vector<std::uint32_t> runs_of_nodes(const TracedRuns& traced) {
  const PathRecord& paths = traced.paths();
  std::vector<std::uint32_t> runs(paths.nodes.size(), PathNode::kNone);
  for (std::uint32_t r = 0; r < traced.runs().size(); ++r) {
    const TracedRun& run = traced.runs()[r];
    for (std::size_t d = 0; d < run.deposits; ++d) runs[paths.deposits[run.first_deposit + d]] = r;
  }
  for (const PathTally& tally : paths.tallies)
    if (tally.node != PathNode::kNone) runs[tally.node] = tally.run;
  for (std::size_t i = runs.size(); i-- > 0;)
    if (const std::uint32_t before = paths.nodes[i].before;
        runs[i] != PathNode::kNone && before != PathNode::kNone)
      runs[before] = runs[i];
  return runs;
}

// Sums of the powers that leave the hits of a material, as they were traced and with the factors
// of what came before the hit.
struct LeavingPower {
  std::array<double, kBandCount> traced{}, reweighed{};

  void add(const Bands& power, const Bands* factors_before) {
    for (std::size_t b = 0; b < kBandCount; ++b) {
      traced[b] += static_cast<double>(power[b]);
      reweighed[b] += static_cast<double>(power[b]) *
                      static_cast<double>(factors_before != nullptr ? (*factors_before)[b] : 1.0f);
    }
  }
};

// The powers of `run.arrived` with other absorption. Their ratios are those of the powers that have
// left the same material, since both have met the same surfaces before.
std::vector<ArrivedPower> reweighed_arrivals(const KeptRun& run, std::span<const Bands> factors,
                                             std::size_t materials) {
  std::vector<LeavingPower> leaving(materials);
  const auto add = [&](std::uint32_t node, const Bands& power) {
    const PathNode& hit = run.paths.nodes[node];
    leaving[hit.material].add(power,
                              hit.before == PathNode::kNone ? nullptr : &factors[hit.before]);
  };
  for (std::size_t i = 0; i < run.deposits.size(); ++i)
    add(run.paths.deposits[i], run.deposits[i].power);
  for (const PathTally& tally : run.paths.tallies)
    if (tally.kind == PathTally::Kind::kOfImage) add(tally.node, tally.power);
  std::vector<ArrivedPower> arrived = run.arrived;
  for (ArrivedPower& at : arrived)
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (const LeavingPower& left = leaving[at.material]; left.traced[b] > 0)
        at.power[b] = static_cast<float>(static_cast<double>(at.power[b]) * left.reweighed[b] /
                                         left.traced[b]);
  return arrived;
}

}  // namespace

std::uint64_t KeptRun::bytes() const {
  return sizeof(KeptRun) + arrived.size() * sizeof(ArrivedPower) +
         deposits.size() * (sizeof(Deposit) + sizeof(std::uint32_t)) +
         paths.nodes.size() * sizeof(PathNode) + paths.tallies.size() * sizeof(PathTally);
}

TracedRuns KeptRun::reweighed(std::span<const Bands> ratios) const {
  const std::vector<Bands> factors = factors_of(paths.nodes, ratios);
  TraceTally sums = tally;
  sums.power_escaped = sums.power_unfinished = sums.power_of_images = {};
  for (const PathTally& power : paths.tallies) {
    std::uint32_t node = power.node;
    if (power.kind == PathTally::Kind::kUnfinished && node != PathNode::kNone)
      node = paths.nodes[node].before;
    auto& sum = power.kind == PathTally::Kind::kEscaped      ? sums.power_escaped
                : power.kind == PathTally::Kind::kUnfinished ? sums.power_unfinished
                                                             : sums.power_of_images;
    for (std::size_t b = 0; b < kBandCount; ++b)
      sum[b] += static_cast<double>(power.power[b]) *
                static_cast<double>(node == PathNode::kNone ? 1.0f : factors[node][b]);
  }

  std::vector<Deposit> weighed;
  for (std::size_t i = 0; i < deposits.size(); ++i) {
    Deposit deposit = deposits[i];
    float loudest = 0;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      deposit.power[b] *= factors[paths.deposits[i]][b];
      loudest = std::max(loudest, deposit.power[b]);
    }
    if (loudest > 0) weighed.push_back(deposit);
  }
  TracedRuns result;
  result.append(run, sums, weighed, reweighed_arrivals(*this, factors, ratios.size()));
  return result;
}

std::vector<KeptRun> kept_runs(const TracedRuns& traced) {
  std::vector<KeptRun> kept;
  for (const TracedRun& run : traced.runs()) {
    const auto deposits = traced.deposits_of(run);
    kept.push_back({run.run, run.tally, run.arrived, {deposits.begin(), deposits.end()}, {}});
  }
  // Runs that are traced together share one list of nodes, in which a parent precedes its children.
  const PathRecord& paths = traced.paths();
  const std::vector<std::uint32_t> runs = runs_of_nodes(traced);
  std::vector<std::uint32_t> places(paths.nodes.size(), PathNode::kNone);  // in the run's own list
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (runs[i] == PathNode::kNone) continue;
    auto& nodes = kept[runs[i]].paths.nodes;
    places[i] = static_cast<std::uint32_t>(nodes.size());
    PathNode node = paths.nodes[i];
    if (node.before != PathNode::kNone) node.before = places[node.before];
    nodes.push_back(node);
  }
  for (std::size_t r = 0; r < kept.size(); ++r) {
    const TracedRun& run = traced.runs()[r];
    for (std::size_t d = 0; d < run.deposits; ++d)
      kept[r].paths.deposits.push_back(places[paths.deposits[run.first_deposit + d]]);
  }
  for (PathTally tally : paths.tallies) {
    if (tally.node != PathNode::kNone) tally.node = places[tally.node];
    kept[tally.run].paths.tallies.push_back(tally);
  }
  for (KeptRun& run : kept) {
    run.paths.nodes.shrink_to_fit();
    run.paths.deposits.shrink_to_fit();
    run.paths.tallies.shrink_to_fit();
  }
  return kept;
}

}  // namespace clamor
