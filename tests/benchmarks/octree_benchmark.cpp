// octree_benchmark.cpp: time and memory of building the octree, which decide how large a bake may
// be.
//
// The sources lie on the walls of a hall; the list is the same for all variants, which alternate
// within one run. Values are medians:
//
//   one_s, two_s     seconds on one thread and on two
//   two_of_one       speedup by two threads, meaningful on an idle machine
//   of_serial        speedup of one thread over the reference, octree_reference.h
//   memory_times     peak memory, list and tree included, relative to that of the list
//   external_of_one  time of an external sort with a tenth of the list's memory on one thread,
//                    including disk access, relative to the sort in memory
//
// The benchmark fails unless the tree equals the reference's bit by bit on any number of threads.
#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include <benchmark/benchmark.h>

#include "bake/octree/octree_builder.h"
#include "bake/octree/octree_streaming.h"
#include "common/thread_team.h"
#include "tests/benchmarks/wall_times.h"
#include "tests/octree_reference.h"
#include "tests/peak_memory.h"
#include "tests/source_lists.h"

namespace clamor {
namespace {

using testing::Clock;
using testing::median;
using testing::seconds_since;

// An octree sink that discards its input.
class Drain : public OctreeSink {
 public:
  Result<std::size_t> add_subtree(SourceOctree&& subtree) override {
    sources += subtree.sources.size();
    return 0;
  }
  Result<std::size_t> add_node(const NodeSummary& node, std::span<const Source>,
                               const std::array<std::optional<std::size_t>, 8>&) override {
    sources += node.source_count;
    return 0;
  }
  std::size_t sources = 0;
};

// Time of the whole external build: from the list to the disk to the sink.
double external_seconds(std::span<const Source> sources) {
  const auto start = Clock::now();
  ScratchList<Source> list(
      (std::filesystem::temp_directory_path() / "clamor_octree_benchmark").string());
  Drain drain;
  bool done = true;
  for (std::size_t i = 0; i < sources.size() && done; i += 4096)
    done = list.append(sources.subspan(i, std::min<std::size_t>(4096, sources.size() - i))).ok();
  with_team(1, [&] {
    done = done && stream_octree(std::move(list), sources.size_bytes() / 10, drain).ok();
  });
  return done && drain.sources == sources.size() ? seconds_since(start) : 0;
}

void octree(benchmark::State& state) {
  const auto sources = testing::wall_sources(static_cast<std::uint32_t>(state.range(0)));
  const auto list_bytes = static_cast<double>(sources.size() * sizeof(Source));
  SourceOctree expected;
  double serial_s = 0;
  {
    auto list = sources;
    const auto start = Clock::now();
    expected = testing::build_octree_serially(std::move(list));
    serial_s = seconds_since(start);
  }
  std::vector<double> one_s, two_s, external_s;
  double memory_times = 0;
  for (auto _ : state) {
    for (const int threads : {1, 2}) {
      auto list = sources;
      const testing::PeakMemory peak;
      SourceOctree tree;
      const auto start = Clock::now();
      with_team(threads, [&] { tree = build_octree(std::move(list)); });
      (threads == 1 ? one_s : two_s).push_back(seconds_since(start));
      memory_times = std::max(memory_times,
                              (list_bytes + static_cast<double>(peak.more_bytes())) / list_bytes);
      if (!testing::same_octree(tree, expected)) return state.SkipWithError("the tree differs");
    }
    external_s.push_back(external_seconds(sources));
    if (external_s.back() == 0) return state.SkipWithError("the external sort lost sources");
  }
  state.counters["external_of_one"] = median(external_s) / median(one_s);
  state.counters["one_s"] = median(one_s);
  state.counters["two_s"] = median(two_s);
  state.counters["two_of_one"] = median(one_s) / median(two_s);
  state.counters["of_serial"] = serial_s / median(one_s);
  state.counters["memory_times"] = memory_times;
}
BENCHMARK(octree)
    ->ArgName("sources")
    ->Arg(100'000)
    ->Arg(1'000'000)
    ->Arg(10'000'000)
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
