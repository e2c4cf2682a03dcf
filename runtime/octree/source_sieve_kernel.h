// source_sieve_kernel.h: what source_sieve.cpp asks of its vector code.
#pragma once

#include <cstddef>
#include <span>

#include "runtime/octree/source_sieve.h"

namespace clamor {

struct SieveQuery {
  Vec3f from_m{};    // of the sieve's middle
  float give_m = 0;  // what positions may be off
  // (r - give)^2 >= keep r^2 - less, whatever r.
  float keep = 1, less_m2 = 0;
  float least = 0;  // the threshold
};

// Fills `sifted` with those of `count` sources in these blocks that may reach the query's
// threshold.
void sift_with(std::span<const SieveBounds> bounds, std::span<const SieveBlock> blocks,
               std::size_t count, const SieveQuery& query, Sifted& sifted);

}  // namespace clamor
