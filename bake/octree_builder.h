// octree_builder.h: sorts the sources of a bake into the heap-ordered octree.
#pragma once

#include <vector>

#include "formats/source_octree.h"

namespace clamor {

// The key here is the power summed over bands, over u. Sources with equal keys keep their order, so
// the tree is a function of the list. Costs one copy of the list; 1 million take about a second.
SourceOctree build_octree(std::vector<Source> sources);

}  // namespace clamor
