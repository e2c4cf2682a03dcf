// query_benchmark.cpp: cost of sampling k of n sources while a listener walks, which should not
// depend on n.
//
// The sources lie on the walls of a 20 x 8 x 15 m hall, with powers spread over 60 dB and lobes of
// one exponent in all eight bands (0: Lambertian). `median_ms` and `min_ms` are the thread's CPU
// time of one sample of the octree with all pages in memory. `pages` are visited and `entries` are
// sources in them that were not culled with their neighbours. `scan_ms` is the time of scanning all
// sources for the same sample, where they fit into memory twice. city_benchmark.cpp measures a
// billion sources.
#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <benchmark/benchmark.h>

#include "bake/octree/octree_builder.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/benchmarks/sample_times.h"
#include "tests/source_lists.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

constexpr std::size_t kMaxToScan = 1'000'000;

const testing::StoredTrees& trees_of(std::uint32_t count) {
  static std::map<std::uint32_t, testing::StoredTrees> known;
  if (!known.contains(count)) {
    known.clear();  // only one at a time, since ten million sources take a gigabyte
    known[count].add(build_octree(testing::wall_sources(count)));
  }
  return known[count];
}

void query(benchmark::State& state) {
  const testing::StoredTrees& trees = trees_of(static_cast<std::uint32_t>(state.range(0)));
  const auto voices = static_cast<std::size_t>(state.range(1));
  const auto exponent = static_cast<float>(state.range(2));
  std::vector<Material> materials(1);
  materials[0].scattering = same_in_all_bands(exponent > 0 ? 0.0f : 1.0f);
  materials[0].phong = same_in_all_bands(exponent);
  const std::vector<Emitter> emitters(1);
  const RadiationModel radiation(emitters, materials, Air{});
  SignalWeights weights;
  weights.by_signal = {same_in_all_bands(1)};
  PageLoader loader(trees.fetch(radiation, weights), PageBudget{4'000'000'000});
  OctreePool pool(radiation, weights, trees.tops(), {}, loader);
  const auto sampler = make_priority_sampler(radiation, weights, pool, voices);
  double time_s = 0;
  ListenerMotion motion(0.02);
  const auto walk = [&] {
    time_s += 0.02;
    return motion.next(Vec3(10 + 6 * std::sin(time_s / 6), 1.7, 7 + 4 * std::cos(time_s / 6)));
  };
  constexpr double kWalk_s = 2;
  for (int i = 0; i < 50 * kWalk_s; ++i) {  // loads the pages of the whole walk
    const Listener listener = walk();
    sampler->sample(listener);
    while (!sampler->complete()) sampler->sample(listener);
  }
  time_s = 0;
  sampler->sample(walk());
  const std::uint64_t pages_before = pool.nodes_visited();
  const std::uint64_t entries_before = pool.sources_tested();
  testing::SampleTimes times;
  std::uint64_t samples = 0;
  std::size_t chosen = 0;
  for (auto _ : state) {
    times.time([&] { chosen = sampler->sample(walk()).size(); });
    ++samples;
    if (time_s > kWalk_s - 0.03) time_s = 0;
  }
  if (chosen != std::min<std::uint64_t>(voices, pool.size()))
    state.SkipWithError("voices are missing");
  const auto per_sample = [&](std::uint64_t count) {
    return static_cast<double>(count) / static_cast<double>(samples);
  };
  times.report(state);
  state.counters["pages"] = per_sample(pool.nodes_visited() - pages_before);
  state.counters["entries"] = per_sample(pool.sources_tested() - entries_before);
  if (pool.size() > kMaxToScan) return;
  SourceList list(radiation, weights, trees.all_sources());
  const auto scan = make_priority_sampler(radiation, weights, list, voices);
  time_s = 0;
  scan->sample(walk());
  testing::SampleTimes scans;
  for (int i = 0; i < 10; ++i) scans.time([&] { scan->sample(walk()); });
  state.counters["scan_ms"] = scans.median_ms();
}
BENCHMARK(query)
    ->ArgNames({"sources", "voices", "exponent"})
    ->ArgsProduct({{10'000, 100'000}, {500, 2000, 20'000}, {0}})
    ->ArgsProduct({{1'000'000, 10'000'000}, {500, 2000, 20'000}, {0, 20, 100}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
