// octree_builder.h: sorts the sources of a bake into the heap-ordered octree, in memory.
//
// Level by level, so that nodes come out breadth first. Of a source only its key, place in the list
// and position (20 bytes) are moved about, from one array to another and back, a level each; the
// sources themselves are moved once, at the end. The cells of a level are worked on in parallel,
// and large ones in parts; the tree is a function of the list, whatever the number of threads.
//
// Threads: as many as the TBB arena it is called in.   Memory: the list, the tree and 4 bytes a
// source; that is 2.1 times the list. A list that does not fit: octree_streaming.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/bake_file/source_octree.h"

namespace clamor {

// Of each octant, by the sources that are handed to it, the first one of its child.
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

// The key here is the power summed over bands, over u. Sources with equal keys keep their order, in
// a leaf of several octants octant by octant.
// Fewer than 2^32 sources.
SourceOctree build_octree(std::vector<Source> sources);

// The part of a tree that lies in one of its cubes.
SourceOctree build_octree(std::vector<Source> sources, const OctreeCube& cube);

}  // namespace clamor
