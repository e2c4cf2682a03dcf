#include "runtime/probes/probe_copies.h"

#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

#include "common/random.h"
#include "runtime/propagation/source_number.h"

namespace clamor {

namespace {

constexpr std::uint32_t kSeedOfCopies = 0x70726f62;
// Target number of copies per source of a tree, after thinning.
constexpr double kCopiesPerSource = 8;
// A copy holds at least so many sources of its tree's top page, or nearly.
constexpr double kLeastTopSources = 4;

// Multiples of the golden ratio: of n consecutive numbers, no two neighbouring hashes are further
// apart than 2.7 / n of the range, so that no copy is left without a source of the top page.
std::uint32_t hash_of(std::uint64_t probe_source) {
  return static_cast<std::uint32_t>(probe_source * 0x9e3779b97f4a7c15u >> 32);
}

// The first hash that agrees with this one in its first `level` bits.
std::uint32_t first_alike(std::uint32_t hash, std::uint32_t level) {
  return level == 0 ? 0 : hash & ~(~std::uint32_t{0} >> level);
}

// A copy holds one in 2^level sources of its tree. It holds all where there are few copies, and
// where it makes up much of the loudness of all of them: its own voices are heard then.
std::uint32_t crowd_level(const ProbeCopy& copy, const ProbeCopies::Tree& tree) {
  const double others = std::min(static_cast<double>(tree.copy_count),
                                 tree.loudness / static_cast<double>(copy.loudness));
  const double excess = std::min(others / kCopiesPerSource,
                                 static_cast<double>(tree.entry->source_count) / kLeastTopSources);
  return excess < 2 ? 0 : static_cast<std::uint32_t>(std::ilogb(excess));
}

}  // namespace

ProbeCopies::ProbeCopies(const StoredProbes& probes) {
  std::uint64_t first = kFirstProbeSource;
  const auto add_tree = [&](const PageEntry& top, const std::optional<Vec3>& probe_m) {
    Tree& tree = trees_.emplace_back();
    tree.entry = &top;
    tree.probe_m = probe_m;
    tree.first_source = first;
    tree.power = total_power(top);
    first += top.sources_below;
  };
  for (const StoredProbe& probe : probes.places) {
    add_tree(probe.tree.top, probe.position_m);
    zone_trees_.push_back(static_cast<std::uint32_t>(probes.places.size() + probe.zone));
  }
  for (const StoredTree& zone : probes.zones) add_tree(zone.top, std::nullopt);
}

void ProbeCopies::begin() {
  for (const std::uint32_t t : active_) trees_[t].copy_count = trees_[t].crowd_count = 0;
  active_.clear();
  copies_.clear();
  crowds_.clear();
}

void ProbeCopies::add(std::size_t slot, std::uint32_t generation,
                      std::span<const ProbeWeight> probes, float factor, float at_any_time) {
  std::array<ProbeWeight, kMaxCopies> zones{};
  std::size_t zone_count = 0;
  for (const ProbeWeight& probe : probes) {
    add(slot, generation, probe, factor, at_any_time);
    const std::uint32_t tree = zone_trees_[probe.probe];
    std::size_t z = 0;
    while (z < zone_count && zones[z].probe != tree) ++z;
    zone_count = std::max(zone_count, z + 1);
    zones[z].probe = tree;
    zones[z].weight += probe.weight;
  }
  for (const ProbeWeight& zone : std::span(zones).first(zone_count))
    add(slot, generation, zone, factor, at_any_time);
}

void ProbeCopies::add(std::size_t slot, std::uint32_t generation, const ProbeWeight& weight,
                      float factor, float at_any_time) {
  Tree& tree = trees_[weight.probe];
  if (!(tree.power > 0 && weight.weight > 0)) return;
  ProbeCopy& copy = copies_.emplace_back();
  copy.tree = weight.probe;
  copy.slot = static_cast<std::uint32_t>(slot);
  copy.weight = weight.weight;
  copy.factor = weight.weight * factor;
  copy.loudness = copy.factor * at_any_time;
  const RandomBits bits = philox(kSeedOfCopies, {copy.slot, generation, copy.tree, 0});
  copy.u = static_cast<float>(unit_above_zero(bits[0]));
  copy.draw = unit(bits[1]);
  copy.hash = bits[2];
  if (tree.copy_count++ == 0) {
    active_.push_back(copy.tree);
    tree.factor = 0;
    tree.loudness = 0;
  }
  tree.loudness += static_cast<double>(copy.loudness);
}

void ProbeCopies::finish() {
  for (ProbeCopy& copy : copies_) {
    copy.level = crowd_level(copy, trees_[copy.tree]);
    copy.weight *= copy.scale();
    copy.factor *= copy.scale();
  }
  std::ranges::sort(copies_, {}, [](const ProbeCopy& copy) {
    return std::tuple(copy.tree, copy.level, copy.hash, copy.slot);
  });
  for (std::uint32_t c = 0; c < copies_.size(); ++c) {
    const ProbeCopy& copy = copies_[c];
    Tree& tree = trees_[copy.tree];
    if (tree.crowd_count == 0) {
      tree.first_copy = c;
      tree.first_crowd = static_cast<std::uint32_t>(crowds_.size());
    }
    if (tree.crowd_count == 0 || crowds_.back().level != copy.level) {
      ++tree.crowd_count;
      crowds_.push_back({copy.level, c, 0, 0});
    }
    ++crowds_.back().copy_count;
    crowds_.back().factor = std::max(crowds_.back().factor, copy.factor);
    tree.factor = std::max(tree.factor, copy.factor);
  }
}

std::span<const ProbeCopy> ProbeCopies::holders(const Crowd& crowd, std::uint64_t source) const {
  const auto all = std::span(copies_).subspan(crowd.first_copy, crowd.copy_count);
  if (crowd.level == 0) return all;
  const std::uint32_t from = first_alike(hash_of(source), crowd.level);
  const auto first = std::ranges::lower_bound(all, from, {}, &ProbeCopy::hash);
  auto last = first;
  while (last != all.end() && first_alike(last->hash, crowd.level) == from) ++last;
  return {first, last};
}

// Each source of the top page represents itself, or what the highest missing key hides below it, so
// that together they represent the whole tree.
void ProbeCopies::draw_representatives(Tree& tree, const ResidentPage* top) {
  const auto hash_at = [&](std::uint32_t i) {
    return std::uint64_t{hash_of(tree.first_source + i)};
  };
  if (top != tree.top) {
    tree.top = top;
    tree.share_ends.clear();
    tree.order.resize(top != nullptr ? top->sources.size() : 0);
    std::iota(tree.order.begin(), tree.order.end(), 0);
    std::ranges::sort(tree.order, {}, hash_at);
    double highest_below = 0, sum = 0;
    if (top != nullptr)
      for (const PageEntry& child : top->links.children)
        highest_below = std::max(highest_below, static_cast<double>(child.highest_key));
    for (const std::uint32_t i : tree.order)
      tree.share_ends.push_back(sum += std::max(sum_of(top->sources[i].power), highest_below));
  }
  const auto& ends = tree.share_ends;
  if (ends.empty()) return;
  const auto place_of = [&](std::uint64_t hash) {
    return std::ranges::lower_bound(tree.order, hash, {}, hash_at) - tree.order.begin();
  };
  for (ProbeCopy& copy : std::span(copies_).subspan(tree.first_copy, tree.copy_count)) {
    const std::uint64_t from = first_alike(copy.hash, copy.level);
    const std::ptrdiff_t first = place_of(from),
                         end = place_of(from + (std::uint64_t{1} << (32 - copy.level)));
    const double before = first == 0 ? 0 : ends[static_cast<std::size_t>(first - 1)];
    const double share = before + copy.draw * (ends[static_cast<std::size_t>(end - 1)] - before);
    const auto at = std::upper_bound(ends.begin() + first, ends.begin() + end, share);
    copy.representative =
        tree.order[static_cast<std::size_t>(std::min(at - ends.begin(), end - 1))];
  }
}

}  // namespace clamor
