// octree_builder.h: builds the heap-ordered octree from sources in memory.
//
// The builder works depth by depth, so nodes come out breadth first. Only the key, list position
// and coordinates of a source (20 bytes) move between two arrays, once per depth; the sources
// themselves move once at the end. A cell is a cube with the sources that are not in a node yet;
// the cells of a depth are divided in parallel, and large cells in parts. The tree depends on the
// list alone, not on the number of threads.
//
// Threads: the caller's team. Memory: the list, which becomes the tree's, and 44 bytes
// per source, 1.5 times the list. For lists that do not fit into memory see octree_streaming.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/bake_file/source_octree.h"

namespace clamor {

// Joins consecutive octants as long as their sources fit into one leaf: given the number of sources
// in each octant, returns for each octant the first octant of the child node that it belongs to.
inline std::array<std::size_t, 8> first_octants(const std::array<std::uint64_t, 8>& counts) {
  std::array<std::size_t, 8> firsts{};
  std::uint64_t together = 0;
  for (std::size_t o = 0, first = 0; o < 8; ++o) {
    if (together == 0 || together + counts[o] > kLeafSources) {
      first = o;
      together = 0;
    }
    firsts[o] = first;
    together += counts[o];
  }
  return firsts;
}

// Builds a tree with key = power summed over bands / u. Sources with equal keys keep their order;
// in a leaf of several octants they are ordered by octant first. Requires fewer than 2^32 sources.
SourceOctree build_octree(std::vector<Source> sources);

// Builds the octree with this cube as that of the root. All sources must lie in it.
SourceOctree build_octree(std::vector<Source> sources, const OctreeCube& cube);

}  // namespace clamor
