#include "bake/instances/instance_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

#include "bake/octree/octree_summary.h"
#include "common/bounds.h"
#include "common/morton_order.h"
#include "common/random.h"

namespace clamor {

namespace {

constexpr std::uint32_t kChoice = 0xc0b1e5, kNumber = 0xc0b1e6;  // random number streams

double power_of(const Source& source) { return sum_of(source.power); }

double power_of(const Instance& instance, std::span<const PageEntry> trees) {
  return static_cast<double>(instance.gain) * instance.gain * total_power(trees[instance.tree]);
}

// Centre of an instance's bounds, which may be far from its origin.
Vec3 middle_of(const Instance& instance, std::span<const PageEntry> trees) {
  const PageEntry& tree = trees[instance.tree];
  return Placement{}.then(instance).outside(Vec3(tree.low_m + tree.high_m) / 2.0);
}

// Index, from 1, of the first point of the van der Corput sequence 0, 1/2, 1/4, 3/4, 1/8, ... (J.
// G. van der Corput, 1935) in [from, from + length) on a circle of length 1.
std::uint64_t first_hit(double from, double length) {
  constexpr int kFinest = 50;
  for (int level = 0; level <= kFinest; ++level) {
    const double points = std::ldexp(1.0, level);
    const double next = std::ceil(from * points);
    if (next >= (from + length) * points) continue;
    // The interval holds no coarser point, so the index is odd; its reversed bits are the position.
    auto odd = static_cast<std::uint64_t>(next) & ((1ull << level) - 1);
    std::uint64_t place = 0;
    for (int bit = 0; bit < level; ++bit, odd >>= 1) place = place << 1 | (odd & 1);
    return place + 1;
  }
  return (1ull << kFinest) + 1;
}

// Probability that one of the first `count` points, all rotated by the same random angle, falls
// into an arc of this length. The points divide the circle into gaps of two sizes.
double chance_of_hit(std::uint64_t count, double length) {
  if (count == 0) return 0;
  const int level = std::bit_width(count) - 1;
  const double gap = std::ldexp(1.0, -level);
  const double halved = static_cast<double>(count - (1ull << level));
  const double whole = static_cast<double>(1ull << level) - halved;
  return 2 * halved * std::min(gap / 2, length) + whole * std::min(gap, length);
}

// Calls set(i, u) for each source. Sources are arcs of a circle, in Morton order, with lengths
// proportional to their power. The n-th point of the rotated van der Corput sequence selects the
// source of approximately the n-th highest key. The sources with the m highest keys therefore
// represent equal shares of power, spread over the prototype, for every m: the error of m chosen
// sources falls as 1 / m, where independent u give 1 / sqrt(m), alike in all instances of a
// variant.
//
// u is the probability that an arc of this length would have been hit by then, so it is uniform.
// The first point gives P_i / P, so exactly one key exceeds P.
template <class Set>
void draw(const std::vector<double>& powers, const std::vector<Vec3>& places, std::uint64_t seed,
          const Set& set) {
  const double total = std::accumulate(powers.begin(), powers.end(), 0.0);
  const double turned = unit(philox(seed, {0, 0, kChoice, 0})[0]);
  double from = 0;
  for (const std::size_t i : morton_order(places)) {
    const double random =
        unit_above_zero(philox(seed, {static_cast<std::uint32_t>(i), 0, kNumber, 0})[0]);
    double u = random;
    if (powers[i] > 0) {
      const double length = powers[i] / total, at = from / total + turned;
      const std::uint64_t hit = first_hit(at - std::floor(at), length);
      const double before = chance_of_hit(hit - 1, length);
      u = before + (chance_of_hit(hit, length) - before) * random;
      from += powers[i];
    }
    set(i, static_cast<float>(std::clamp(u, 0x1p-60, 1.0)));
  }
}

struct InstanceRange {
  std::size_t first, count;
};
struct PlacedInstance {
  Vec3 middle_m;
  Instance instance;
};

// Sorts a range along its longest edge and halves it.
std::array<InstanceRange, 2> split_at_median(std::span<PlacedInstance> placed,
                                             const InstanceRange& part) {
  const auto range = placed.subspan(part.first, part.count);
  const Bounds middles = bounds_of(range, &PlacedInstance::middle_m);
  const Vec3 size = middles.high_m - middles.low_m;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t half = part.count / 2;
  std::stable_sort(range.begin(), range.end(),
                   [axis](const PlacedInstance& a, const PlacedInstance& b) {
                     return a.middle_m[axis] < b.middle_m[axis];
                   });
  return {InstanceRange{part.first, half}, InstanceRange{part.first + half, part.count - half}};
}

}  // namespace

void draw_prototype_u(std::span<Source> sources, std::uint64_t seed) {
  draw_prototype_u(sources, {}, {}, seed);
}

void draw_prototype_u(std::span<Instance> instances, std::span<const PageEntry> trees,
                      std::uint64_t seed) {
  draw_prototype_u({}, instances, trees, seed);
}

void draw_prototype_u(std::span<Source> sources, std::span<Instance> instances,
                      std::span<const PageEntry> trees, std::uint64_t seed) {
  std::vector<double> powers;
  std::vector<Vec3> places;
  for (const Source& source : sources) {
    powers.push_back(power_of(source));
    places.emplace_back(source.position_m);
  }
  for (const Instance& instance : instances) {
    powers.push_back(power_of(instance, trees));
    places.push_back(middle_of(instance, trees));
  }
  draw(powers, places, seed, [&](std::size_t i, float u) {
    if (i < sources.size())
      sources[i].u = u;
    else
      instances[i - sources.size()].u = u;
  });
}

void draw_instance_u(std::span<Instance> instances, std::uint64_t seed) {
  for (std::size_t i = 0; i < instances.size(); ++i)
    instances[i].u = static_cast<float>(
        unit_above_zero(philox(seed, {static_cast<std::uint32_t>(i), 1, kNumber, 0})[0]));
}

SourceOctree instance_tree(std::vector<Instance> instances, std::span<const PageEntry> trees) {
  SourceOctree tree;
  if (instances.empty()) return tree;
  std::vector<PlacedInstance> placed;
  for (const Instance& instance : instances)
    placed.push_back({middle_of(instance, trees), instance});
  // The tree is built breadth first by median splits, eight parts at a time.
  std::vector<InstanceRange> parts = {{0, instances.size()}};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    OctreeNode node;
    node.divides_space = false;
    if (parts[i].count <= kMaxInstances) {
      node.first_instance = static_cast<std::uint32_t>(parts[i].first);
      node.instance_count = static_cast<std::uint32_t>(parts[i].count);
    } else {
      std::vector<InstanceRange> into = {parts[i]};
      for (int halvings = 0; halvings < 3; ++halvings) {
        std::vector<InstanceRange> halves;
        for (const InstanceRange& part : into)
          for (const InstanceRange& half : split_at_median(placed, part)) halves.push_back(half);
        into = halves;
      }
      for (std::size_t k = 0; k < into.size(); ++k) {
        node.children[k] = static_cast<std::uint32_t>(parts.size());
        parts.push_back(into[k]);
      }
    }
    tree.nodes.push_back(node);
  }
  for (std::size_t i = 0; i < placed.size(); ++i) instances[i] = placed[i].instance;
  for (std::size_t i = tree.nodes.size(); i-- > 0;) {
    OctreeNode& node = tree.nodes[i];
    std::array<const NodeSummary*, 8> children;
    std::size_t count = 0;
    for (const std::uint32_t child : node.children)
      if (child != kNoNode) children[count++] = &tree.nodes[child];
    summarise(node, {}, std::span(children).first(count));
    include_instances(std::span(instances).subspan(node.first_instance, node.instance_count), trees,
                      node);
  }
  tree.instances = std::move(instances);
  return tree;
}

SourceOctree with_instances(SourceOctree octree, std::vector<Instance> instances,
                            std::span<const PageEntry> trees) {
  SourceOctree below = instance_tree(std::move(instances), trees);
  if (below.nodes.empty()) return octree;
  if (octree.nodes.empty()) return below;
  SourceOctree both;
  OctreeNode top;
  top.divides_space = false;
  summarise(top, {}, std::array<const NodeSummary*, 2>{&octree.nodes[0], &below.nodes[0]});
  both.nodes.push_back(top);
  const auto add = [&both](const SourceOctree& tree) {
    const auto first = static_cast<std::uint32_t>(both.nodes.size());
    for (OctreeNode node : tree.nodes) {
      for (std::uint32_t& child : node.children)
        if (child != kNoNode) child += first;
      node.first_source += both.sources.size();
      both.nodes.push_back(node);
    }
    return first;
  };
  both.nodes[0].children[0] = add(octree);
  both.sources = std::move(octree.sources);
  both.nodes[0].children[1] = add(below);
  both.instances = std::move(below.instances);
  return both;
}

PageEntry root_entry(const SourceOctree& octree, std::span<const PageEntry> trees) {
  PageEntry top;
  if (octree.nodes.empty()) return top;
  static_cast<NodeSummary&>(top) = octree.nodes[0];
  top.sources_below = octree.sources.size();
  for (const Instance& instance : octree.instances)
    top.sources_below += trees[instance.tree].sources_below;
  return top;
}

}  // namespace clamor
