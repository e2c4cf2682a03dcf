// octree_reference.h: builds the octree of a list of sources with plain code, as a reference for
// builders.
//
// Processes one cell after the other, each with its own list; quadratic where many sources share a
// place.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>
#include <vector>

#include "bake/octree/octree_summary.h"
#include "formats/bake_file/source_octree.h"

namespace clamor::testing {

// A cube of space and the indices of the sources that remain to be placed in it.
struct SerialCell {
  OctreeCube cube;
  std::vector<std::uint32_t> indices;
};

// Removes the highest keys from the cell and returns them in descending order; the rest stays in
// list order.
inline std::vector<std::uint32_t> take_highest(SerialCell& cell, const std::vector<float>& keys) {
  auto& all = cell.indices;
  std::vector<std::uint32_t> highest = all;
  std::stable_sort(highest.begin(), highest.end(),
                   [&keys](std::uint32_t a, std::uint32_t b) { return keys[a] > keys[b]; });
  highest.resize(all.size() <= kLeafSources ? all.size() : kNodeSources);
  std::vector<std::uint32_t> taken = highest, rest;
  std::sort(taken.begin(), taken.end());
  for (const std::uint32_t index : all)
    if (!std::binary_search(taken.begin(), taken.end(), index)) rest.push_back(index);
  all = std::move(rest);
  return highest;
}

inline SourceOctree build_octree_serially(std::vector<Source> sources) {
  SourceOctree tree;
  if (sources.empty()) return tree;

  std::vector<float> keys(sources.size());
  std::transform(sources.begin(), sources.end(), keys.begin(), octree_key);
  Vec3f low = sources[0].position_m, high = low;
  for (const Source& source : sources) {
    low = glm::min(low, source.position_m);
    high = glm::max(high, source.position_m);
  }
  SerialCell root{OctreeCube::around(Vec3(low), Vec3(high)), {}};
  root.indices.resize(sources.size());
  std::iota(root.indices.begin(), root.indices.end(), 0u);

  // Breadth first: the queue of cells is also the list of nodes, so children follow their parents
  // and the top of the tree is the start of the file.
  std::vector<SerialCell> cells;
  cells.push_back(std::move(root));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto highest = take_highest(cells[i], keys);
    OctreeNode node;
    node.first_source = tree.sources.size();
    node.source_count = static_cast<std::uint32_t>(highest.size());
    for (const auto index : highest) tree.sources.push_back(sources[index]);

    const SerialCell cell = std::move(cells[i]);
    cells[i] = {};
    std::array<std::vector<std::uint32_t>, 8> octants;
    for (const auto index : cell.indices)
      octants[cell.cube.octant_of(Vec3(sources[index].position_m))].push_back(index);
    // Each octant shares a leaf with the octants before it, if it fits.
    std::vector<std::uint32_t>* before = nullptr;
    for (std::size_t o = 0; o < 8; ++o) {
      if (octants[o].empty()) continue;
      if (before != nullptr && before->size() + octants[o].size() <= kLeafSources) {
        before->insert(before->end(), octants[o].begin(), octants[o].end());
        continue;
      }
      node.children[o] = static_cast<std::uint32_t>(cells.size());
      cells.push_back({cell.cube.child(o), std::move(octants[o])});
      before = &cells.back().indices;
    }
    tree.nodes.push_back(node);
  }
  for (std::size_t i = tree.nodes.size(); i-- > 0;) {
    OctreeNode& node = tree.nodes[i];
    std::vector<const NodeSummary*> children;
    for (const auto child : node.children)
      if (child != kNoNode) children.push_back(&tree.nodes[child]);
    summarise(node, std::span(tree.sources).subspan(node.first_source, node.source_count),
              children);
  }
  return tree;
}

inline bool same_summary(const NodeSummary& a, const NodeSummary& b) {
  return a.low_m == b.low_m && a.high_m == b.high_m && a.highest_key == b.highest_key &&
         a.power == b.power && a.cone_axis == b.cone_axis && a.cone_cos == b.cone_cos &&
         a.min_delay_s == b.min_delay_s && a.max_delay_s == b.max_delay_s &&
         a.source_count == b.source_count;
}

inline bool same_octree(const SourceOctree& a, const SourceOctree& b) {
  const auto same_node = [](const OctreeNode& x, const OctreeNode& y) {
    return same_summary(x, y) && x.children == y.children && x.first_source == y.first_source;
  };
  return std::equal(a.nodes.begin(), a.nodes.end(), b.nodes.begin(), b.nodes.end(), same_node) &&
         a.sources.size() == b.sources.size() &&
         (a.sources.empty() ||
          std::memcmp(a.sources.data(), b.sources.data(), a.sources.size() * sizeof(Source)) == 0);
}

}  // namespace clamor::testing
