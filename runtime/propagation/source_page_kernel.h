// source_page_kernel.h: the vector code of source_page.cpp.
#pragma once

#include <cstddef>
#include <span>

#include "runtime/propagation/source_page.h"

namespace clamor {

struct CullQuery {
  Vec3f listener_m{};  // from the middle of the sources
  float error_m = 0;   // of positions
  float threshold = 0;
};

// Finds those of the first `count` sources in these blocks that may reach the query's threshold.
void cull_blocks(std::span<const CullBounds> bounds, std::span<const CullBlock> blocks,
                 std::size_t count, const CullQuery& query, CulledPage& culled);

}  // namespace clamor
