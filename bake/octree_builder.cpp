#include "bake/octree_builder.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "common/maths.h"

namespace clamor {

namespace {

// A cube of space and the sources (as indices) that are still to be placed in it.
struct Cell {
  OctreeCube cube;
  std::vector<std::uint32_t> indices;
};

// Takes the highest keys out of the cell, in descending order; the rest stay, in list order.
std::vector<std::uint32_t> take_highest(Cell& cell, const std::vector<float>& keys) {
  const auto higher = [&keys](std::uint32_t a, std::uint32_t b) {
    return keys[a] != keys[b] ? keys[a] > keys[b] : a < b;
  };
  auto& all = cell.indices;
  const auto taken = std::min<std::size_t>(all.size(), kNodeSources);
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(taken);
  if (middle != all.end()) std::nth_element(all.begin(), middle, all.end(), higher);
  std::sort(all.begin(), middle, higher);
  std::vector<std::uint32_t> highest(all.begin(), middle);
  all.erase(all.begin(), middle);
  std::sort(all.begin(), all.end());
  return highest;
}

// Bounds, power, delays and emission cone of a node from its own sources and its children's nodes.
void summarise(OctreeNode& node, SourceOctree& tree) {
  constexpr float kHuge = 1e30f;
  node.low_m = Vec3f(kHuge);
  node.high_m = Vec3f(-kHuge);
  node.least_delay_s = kHuge;
  node.most_delay_s = 0;
  std::array<double, kBandCount> power{};
  Vec3 axis(0);

  const auto first = tree.sources.begin() + static_cast<std::ptrdiff_t>(node.first_source);
  const auto last = first + node.source_count;
  bool everywhere = false;  // does anything here radiate in all directions
  for (auto source = first; source != last; ++source) {
    node.low_m = glm::min(node.low_m, source->position_m);
    node.high_m = glm::max(node.high_m, source->position_m);
    node.least_delay_s = std::min(node.least_delay_s, source->delay_s);
    node.most_delay_s = std::max(node.most_delay_s, source->delay_s);
    for (std::size_t b = 0; b < kBandCount; ++b) power[b] += source->power[b];
    axis += Vec3(source->normal);
    everywhere |= source->is_emitter;
  }
  node.highest_key = octree_key(*first);

  for (const auto child_index : node.children) {
    if (child_index == kNoNode) continue;
    const OctreeNode& child = tree.nodes[child_index];
    node.low_m = glm::min(node.low_m, child.low_m);
    node.high_m = glm::max(node.high_m, child.high_m);
    node.least_delay_s = std::min(node.least_delay_s, child.least_delay_s);
    node.most_delay_s = std::max(node.most_delay_s, child.most_delay_s);
    for (std::size_t b = 0; b < kBandCount; ++b) power[b] += child.power[b];
    axis += Vec3(child.cone_axis);
    everywhere |= child.cone_cos <= -1;
  }
  for (std::size_t b = 0; b < kBandCount; ++b) node.power[b] = static_cast<float>(power[b]);

  // Half angle of the cone: a surface radiates up to 90 degrees from its normal.
  const double length_of_axis = length(axis);
  if (everywhere || length_of_axis < 1e-6) return;
  node.cone_axis = Vec3f(axis / length_of_axis);
  double widest = 0;
  const auto angle_to = [&node](const Vec3f& v) {
    return acos_of(std::clamp(static_cast<double>(dot(v, node.cone_axis)), -1.0, 1.0));
  };
  for (auto source = first; source != last; ++source)
    widest = std::max(widest, angle_to(source->normal) + std::numbers::pi / 2);
  for (const auto child_index : node.children) {
    if (child_index == kNoNode) continue;
    const OctreeNode& child = tree.nodes[child_index];
    widest = std::max(widest, angle_to(child.cone_axis) + acos_of(child.cone_cos));
  }
  if (widest < std::numbers::pi) node.cone_cos = static_cast<float>(cos_of(widest) - 1e-6);
}

}  // namespace

SourceOctree build_octree(std::vector<Source> sources) {
  SourceOctree tree;
  if (sources.empty()) return tree;

  std::vector<float> keys(sources.size());
  std::transform(sources.begin(), sources.end(), keys.begin(), octree_key);
  Vec3f low = sources[0].position_m, high = low;
  for (const Source& source : sources) {
    low = glm::min(low, source.position_m);
    high = glm::max(high, source.position_m);
  }
  Cell root{OctreeCube::around(Vec3(low), Vec3(high)), {}};
  root.indices.resize(sources.size());
  std::iota(root.indices.begin(), root.indices.end(), 0u);

  // Breadth first: cells wait in a list that is also the list of nodes, so that children come
  // after their parents and the top of the tree is the start of the file.
  std::vector<Cell> cells;
  cells.push_back(std::move(root));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto highest = take_highest(cells[i], keys);
    OctreeNode node;
    node.first_source = tree.sources.size();
    node.source_count = static_cast<std::uint32_t>(highest.size());
    for (const auto index : highest) tree.sources.push_back(sources[index]);

    const Cell cell = std::move(cells[i]);
    cells[i] = {};
    std::array<std::vector<std::uint32_t>, 8> octants;
    for (const auto index : cell.indices)
      octants[cell.cube.octant_of(Vec3(sources[index].position_m))].push_back(index);
    for (std::size_t o = 0; o < 8; ++o) {
      if (octants[o].empty()) continue;
      node.children[o] = static_cast<std::uint32_t>(cells.size());
      cells.push_back({cell.cube.child(o), std::move(octants[o])});
    }
    tree.nodes.push_back(node);
  }
  for (std::size_t i = tree.nodes.size(); i-- > 0;) summarise(tree.nodes[i], tree);
  return tree;
}

}  // namespace clamor
