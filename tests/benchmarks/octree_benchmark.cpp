// How long does sorting the sources into the octree take, and in how much memory? It decides how
// large a bake may be.
//
// Sources on the walls of a hall, the same list for all, in turns within one run; medians:
//
//   one_s, two_s     seconds on one thread, and on two
//   two_of_one       how many times as fast two threads are: of use on an idle machine
//   of_serial        how many times as fast one is as the plainest code, octree_reference.h
//   memory_times     the most memory held, list and tree included, over that of the list
//   external_of_one  how many times as long as in memory an external sort takes, on one thread, in
//                    a tenth of the list's memory; writing and reading the disk included
//
// A fast wrong answer fails: on any number of threads it is the plainest code's tree, to the bit.
#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include "bake/octree/octree_builder.h"
#include "bake/octree/octree_streaming.h"
#include "tests/octree_reference.h"
#include "tests/peak_memory.h"
#include "tests/source_lists.h"

namespace clamor {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Takes what it is given and forgets it.
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

// Of all of it: from the list to the disk to the sink.
double external_seconds(std::span<const Source> sources) {
  const auto start = Clock::now();
  SourceSpill spill((std::filesystem::temp_directory_path() / "clamor_octree_benchmark").string());
  Drain drain;
  bool done = true;
  for (std::size_t i = 0; i < sources.size() && done; i += 4096)
    done = spill.append(sources.subspan(i, std::min<std::size_t>(4096, sources.size() - i))).ok();
  tbb::task_arena(1).execute([&] {
    done = done && stream_octree(std::move(spill), sources.size_bytes() / 10, drain).ok();
  });
  return done && drain.sources == sources.size() ? seconds_since(start) : 0;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
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
      tbb::task_arena arena(threads);
      auto list = sources;
      const testing::PeakMemory peak;
      SourceOctree tree;
      const auto start = Clock::now();
      arena.execute([&] { tree = build_octree(std::move(list)); });
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
