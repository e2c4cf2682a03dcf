// source_culler_kernel.h: the vector code of source_culler.cpp.
#pragma once

#include <cstddef>
#include <span>

#include "runtime/query/source_culler.h"

namespace clamor {

struct CullQuery {
  Vec3f from_m{};     // the listener, from the middle of the sources
  float error_m = 0;  // of positions
  // (r - error)^2 >= keep r^2 - less for every r.
  float keep = 1, less_m2 = 0;
  float threshold = 0;
};

// Fills `result` with those of the first `count` sources in these blocks that may reach the query's
// threshold.
void cull_with(std::span<const CullBounds> bounds, std::span<const CullBlock> blocks,
               std::size_t count, const CullQuery& query, CullResult& result);

}  // namespace clamor
