// source_culler_kernel.h: what source_culler.cpp asks of its vector code.
#pragma once

#include <cstddef>
#include <span>

#include "runtime/query/source_culler.h"

namespace clamor {

struct CullQuery {
  Vec3f from_m{};    // of the sieve's middle
  float give_m = 0;  // what positions may be off
  // (r - give)^2 >= keep r^2 - less, whatever r.
  float keep = 1, less_m2 = 0;
  float least = 0;  // the threshold
};

// Fills `sifted` with those of `count` sources in these blocks that may reach the query's
// threshold.
void cull_with(std::span<const CullBounds> bounds, std::span<const CullBlock> blocks,
               std::size_t count, const CullQuery& query, CullResult& sifted);

}  // namespace clamor
