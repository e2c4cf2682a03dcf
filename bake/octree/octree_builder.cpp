#include "bake/octree/octree_builder.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <functional>
#include <memory>

#include "bake/octree/highest_ranks.h"
#include "bake/octree/octree_summary.h"
#include "common/bounds.h"
#include "common/thread_team.h"

namespace clamor {

namespace {

constexpr std::size_t kPart = 65536;  // entries per task

// The part of a source that sorting needs.
struct Entry {
  std::uint32_t key_bits;
  std::uint32_t place;  // position in the list
  Vec3f position_m;

  std::uint64_t rank() const { return octree_rank(key_bits, place); }
};

// Allocates without initialising, so that the thread that first writes a part also touches its
// pages.
template <class T>
std::unique_ptr<T[]> uninitialised(std::size_t count) {
  return std::make_unique_for_overwrite<T[]>(count);
}

// Calls work(part, first, last) for each part of [0, count).
template <class Work>
void for_parts(std::size_t count, const Work& work) {
  const std::size_t parts = (count + kPart - 1) / kPart;
  if (parts == 1) return work(std::size_t{0}, std::size_t{0}, count);
  team_for(0, parts, [&](std::size_t part) {
    work(part, part * kPart, std::min(count, (part + 1) * kPart));
  });
}

using OctantCounts = std::array<std::uint64_t, 8>;

// A cube and the sources not yet placed in it: a range of one of the two arrays. The same range of
// the other array is free.
struct Cell {
  OctreeCube cube;
  std::size_t first = 0, count = 0;
  unsigned array = 0;
  bool sorted = false;  // sorted by rank already

  std::size_t own() const { return count <= kLeafSources ? count : kNodeSources; }
};

class Sorter {
 public:
  explicit Sorter(std::span<const Source> sources)
      : arrays_{uninitialised<Entry>(sources.size()), uninitialised<Entry>(sources.size())},
        order_(uninitialised<std::uint32_t>(sources.size())) {
    for_parts(sources.size(), [&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i)
        arrays_[0][i] = {key_bits(octree_key(sources[i])), static_cast<std::uint32_t>(i),
                         sources[i].position_m};
    });
  }

  // Writes the cell's highest entries to `order_` from `first_source` on and partitions the others
  // by octant into the other array, starting at the cell's first + own(). Returns the size of each
  // octant.
  OctantCounts divide(Cell& cell, std::uint64_t first_source) {
    Entry* const entries = &arrays_[cell.array][cell.first];
    std::uint32_t* const placed = &order_[first_source];
    if (cell.count <= kLeafSources || cell.cube.depth >= OctreeCube::kDeepest)
      return chain(cell, entries, placed);

    const std::uint64_t least = take_highest(entries, cell.count, placed);
    std::vector<OctantCounts> part_begins((cell.count + kPart - 1) / kPart);
    for_parts(cell.count, [&](std::size_t part, std::size_t first, std::size_t last) {
      OctantCounts counts{};
      for (std::size_t i = first; i < last; ++i)
        if (entries[i].rank() < least) ++counts[octant_of(cell, entries[i])];
      part_begins[part] = counts;
    });
    OctantCounts octants{};
    std::size_t begin = 0;
    for (std::size_t o = 0; o < 8; ++o)
      for (OctantCounts& part : part_begins) {
        const std::size_t count = part[o];
        octants[o] += count;
        part[o] = begin;
        begin += count;
      }
    Entry* const others = &arrays_[1 - cell.array][cell.first + cell.own()];
    for_parts(cell.count, [&](std::size_t part, std::size_t first, std::size_t last) {
      OctantCounts next = part_begins[part];
      for (std::size_t i = first; i < last; ++i)
        if (entries[i].rank() < least) others[next[octant_of(cell, entries[i])]++] = entries[i];
    });
    return octants;
  }

  // The source at each position of the tree; call after all cells are divided.
  std::unique_ptr<std::uint32_t[]> order() && { return std::move(order_); }

 private:
  static std::size_t octant_of(const Cell& cell, const Entry& entry) {
    return cell.cube.octant_of(Vec3(entry.position_m));
  }

  // Places the kNodeSources highest entries and returns the rank of the last one.
  static std::uint64_t take_highest(const Entry* entries, std::size_t count,
                                    std::uint32_t* placed) {
    std::vector<HighestRanks> highest((count + kPart - 1) / kPart);
    for_parts(count, [&](std::size_t part, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) highest[part].offer(entries[i].rank());
    });
    for (std::size_t part = 1; part < highest.size(); ++part)
      for (const std::uint64_t rank : highest[part].descending()) highest[0].offer(rank);
    const auto ranks = highest[0].descending();
    std::transform(ranks.begin(), ranks.end(), placed, place_of_rank);
    return ranks.back();
  }

  // Handles leaves, and chains of nodes at the maximum depth. The entries are sorted only once, or
  // a long chain would cost the square of its length. In a leaf of several octants, sources of
  // equal keys are ordered by octant.
  static OctantCounts chain(Cell& cell, Entry* entries, std::uint32_t* placed) {
    const auto higher = [](const Entry& a, const Entry& b) { return a.rank() > b.rank(); };
    const auto higher_key = [](const Entry& a, const Entry& b) { return a.key_bits > b.key_bits; };
    if (cell.count <= kLeafSources && !cell.sorted)
      std::stable_sort(entries, entries + cell.count, higher_key);
    else if (!cell.sorted)
      team_sort(entries, entries + cell.count, higher);
    cell.sorted = true;
    for (std::size_t i = 0; i < cell.own(); ++i) placed[i] = entries[i].place;
    return {cell.count - cell.own()};
  }

  std::array<std::unique_ptr<Entry[]>, 2> arrays_;
  std::unique_ptr<std::uint32_t[]> order_;
};

// Creates all nodes without their summaries. Returns the first node of each depth and the end.
std::vector<std::size_t> make_nodes(Sorter& sorter, const Cell& root,
                                    std::vector<OctreeNode>& nodes) {
  std::vector<std::size_t> depth_begins;
  std::uint64_t first_source = 0;
  for (std::vector<Cell> cells{root}; !cells.empty();) {
    const std::size_t first_node = nodes.size();
    depth_begins.push_back(first_node);
    for (const Cell& cell : cells) {
      OctreeNode& node = nodes.emplace_back();
      node.first_source = first_source;
      node.source_count = static_cast<std::uint32_t>(cell.own());
      first_source += cell.own();
    }
    std::vector<OctantCounts> octants(cells.size());
    team_for(0, cells.size(), [&](std::size_t i) {
      octants[i] = sorter.divide(cells[i], nodes[first_node + i].first_source);
    });

    std::vector<Cell> below;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Cell& cell = cells[i];
      const auto firsts = first_octants(octants[i]);
      std::size_t first = cell.first + cell.own();
      for (std::size_t o = 0; o < 8; ++o) {
        const std::size_t count = octants[i][o];
        if (count == 0) continue;
        if (firsts[o] == o) {
          nodes[first_node + i].children[o] =
              static_cast<std::uint32_t>(nodes.size() + below.size());
          below.push_back({cell.cube.child(o), first, count,
                           cell.sorted ? cell.array : 1 - cell.array, cell.sorted});
        } else {
          below.back().count += count;
        }
        first += count;
      }
    }
    cells = std::move(below);
  }
  depth_begins.push_back(nodes.size());
  return depth_begins;
}

// Moves source order[i] to i, for all i, without a second list. The cycles of the permutation are
// followed one by one; an element that is in its place has its own index in `order`.
void put_in_order(std::span<Source> sources, std::uint32_t* order) {
  for (std::uint32_t first = 0; first < sources.size(); ++first) {
    if (order[first] == first) continue;
    const Source displaced = sources[first];
    std::uint32_t to = first;
    for (std::uint32_t from = order[to]; from != first; from = order[to]) {
      sources[to] = sources[from];
      order[to] = to;
      to = from;
    }
    sources[to] = displaced;
    order[to] = to;
  }
}

void summarise_all(SourceOctree& tree, const std::vector<std::size_t>& depth_begins) {
  for (std::size_t d = depth_begins.size() - 1; d-- > 0;)
    team_for(depth_begins[d], depth_begins[d + 1], [&](std::size_t i) {
      OctreeNode& node = tree.nodes[i];
      std::array<const NodeSummary*, 8> children{};
      std::size_t count = 0;
      for (const std::uint32_t child : node.children)
        if (child != kNoNode) children[count++] = &tree.nodes[child];
      summarise(node, std::span(tree.sources).subspan(node.first_source, node.source_count),
                std::span(children).first(count));
    });
}

OctreeCube cube_around(std::span<const Source> sources) {
  std::vector<Boundsf> boxes((sources.size() + kPart - 1) / kPart);
  for_parts(sources.size(), [&](std::size_t part, std::size_t first, std::size_t last) {
    boxes[part] = bounds_of(sources.subspan(first, last - first), &Source::position_m);
  });
  Boundsf all;
  for (const Boundsf& box : boxes) all.add(box);
  return OctreeCube::around(Vec3(all.low_m), Vec3(all.high_m));
}

}  // namespace

SourceOctree build_octree(std::vector<Source> sources) {
  if (sources.empty()) return {};
  const OctreeCube cube = cube_around(sources);
  return build_octree(std::move(sources), cube);
}

SourceOctree build_octree(std::vector<Source> sources, const OctreeCube& cube) {
  assert(sources.size() < 0xffffffffu);
  SourceOctree tree;
  if (sources.empty()) return tree;
  std::vector<std::size_t> depth_begins;
  std::unique_ptr<std::uint32_t[]> order;
  {
    Sorter sorter(sources);
    depth_begins = make_nodes(sorter, {cube, 0, sources.size()}, tree.nodes);
    order = std::move(sorter).order();
  }
  tree.sources = std::move(sources);
  put_in_order(tree.sources, order.get());
  summarise_all(tree, depth_begins);
  return tree;
}

}  // namespace clamor
