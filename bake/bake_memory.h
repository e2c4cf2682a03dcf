// bake_memory.h: whether a bake fits into the memory that it may have.
#pragma once

#include <cstdint>

#include "bake/bake_options.h"
#include "bake/bake_plan.h"
#include "common/result.h"

namespace clamor {

struct Level;

// Where the sources are thinned and sorted.
struct SortPlace {
  SortStorage storage = SortStorage::kMemory;
  std::uint64_t step_bytes = 0;  // of memory for each step on disk
};

// Fails if the plan, for each state of the level, exceeds the memory limit. For the threads of the
// calling TBB arena.
Result<SortPlace> check_memory(const Level& level, BakePlan plan, const BakeOptions& options);
Result<void> check_shard_memory(const Level& level, const BakePlan& plan,
                                const BakeOptions& options);

// A shard keeps no sources, so it needs far less memory than a bake.
std::uint64_t shard_memory_bytes(const Level& level, const BakePlan& plan, int threads);

}  // namespace clamor
