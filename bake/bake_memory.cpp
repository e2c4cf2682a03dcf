#include "bake/bake_memory.h"

#include <string>

#include <tbb/task_arena.h>

#include "bake/report/decay_estimate.h"
#include "bake/traced_state.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

std::string in_megabytes(std::uint64_t bytes) {
  return std::to_string((bytes + 999'999) / 1'000'000) + " MB";
}

}  // namespace

Result<SortPlace> check_memory(const Level& level, BakePlan plan, const BakeOptions& options) {
  if (has_closed_state(level)) plan.sources *= 2;
  const int threads = tbb::this_task_arena::max_concurrency();
  const std::uint64_t listening = DecayEstimate::max_bytes(plan.longest_path_s);
  const auto needs = [&](const BakePlan& of, SortStorage sorted) {
    return bake_memory_bytes(level, of, threads, sorted) + listening;
  };
  if (options.memory_bytes == 0 || needs(plan, SortStorage::kMemory) <= options.memory_bytes)
    return SortPlace{};
  const SortStorage last = options.spill.empty() ? SortStorage::kMemory : SortStorage::kFiles;
  const std::uint64_t needed = needs(plan, last);
  // The steps get most of what the smallest of them leave.
  constexpr std::uint64_t kMinStepBytes = 25'000'000;
  if (needed <= options.memory_bytes)
    return SortPlace{last, kMinStepBytes + (options.memory_bytes - needed) / 10 * 6};
  BakePlan bare = plan;
  bare.sources = 0;
  const std::uint64_t least = needs(bare, last);
  const std::string advice =
      least < options.memory_bytes
          ? "--sources " + std::to_string((options.memory_bytes - least) / kBytesPerSource) +
                " would fit"
          : "the level itself needs " + in_megabytes(least);
  return Error("the bake needs about " + in_megabytes(needed) + " of memory, more than the " +
               in_megabytes(options.memory_bytes) + " it may have; " + advice);
}

std::uint64_t shard_memory_bytes(const Level& level, const BakePlan& plan, int threads) {
  BakePlan of_shard = plan;
  of_shard.sources = 0;
  return bake_memory_bytes(level, of_shard, threads) +
         DecayEstimate::max_bytes(plan.longest_path_s);
}

Result<void> check_shard_memory(const Level& level, const BakePlan& plan,
                                const BakeOptions& options) {
  const std::uint64_t needed =
      shard_memory_bytes(level, plan, tbb::this_task_arena::max_concurrency());
  if (options.memory_bytes == 0 || needed <= options.memory_bytes) return {};
  return Error("a shard needs about " + in_megabytes(needed) + " of memory, more than the " +
               in_megabytes(options.memory_bytes) + " it may have");
}

}  // namespace clamor
