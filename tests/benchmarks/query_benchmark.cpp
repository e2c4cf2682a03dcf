// What does choosing k of n sources cost while a listener walks? It should not depend on n.
//
// Sources lie on the walls of a 20 x 8 x 15 m hall, their powers spread over 60 dB. Time is of one
// sample of the octree, all its pages in memory; `nodes` are looked at, `scan_ms` is what scanning
// all sources takes for the same sample, where that fits in memory twice.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <vector>

#include <benchmark/benchmark.h>

#include "bake/octree_builder.h"
#include "runtime/octree_pool.h"
#include "runtime/sampler.h"
#include "tests/source_lists.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

constexpr std::size_t kMostToScan = 1'000'000;

const testing::StoredTrees& trees_of(std::uint32_t count) {
  static std::map<std::uint32_t, testing::StoredTrees> known;
  if (!known.contains(count)) {
    known.clear();  // one at a time: ten million take a gigabyte
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
  const SourceField field(emitters, materials, Air{});
  SignalWeights weights;
  weights.by_signal = {same_in_all_bands(1)};
  PageLoader loader(trees.fetch(field, weights), PageBudget{4'000'000'000});
  OctreePool pool(field, weights, trees.tops(), {}, loader);
  const auto sampler = make_priority_sampler(field, weights, pool, voices);
  double time_s = 0;
  const auto walk = [&] {
    time_s += 0.02;
    return Vec3(10 + 6 * std::sin(time_s / 6), 1.7, 7 + 4 * std::cos(time_s / 6));
  };
  for (int i = 0; i < 500; ++i) {  // the pages of the whole walk
    const Vec3 place = walk();
    sampler->sample(place);
    while (!sampler->complete()) sampler->sample(place);
  }
  time_s = 0;
  sampler->sample(walk());
  const std::uint64_t before = pool.nodes_visited();
  std::uint64_t samples = 0;
  std::size_t chosen = 0;
  for (auto _ : state) {
    const auto sample = sampler->sample(walk());
    chosen = sample.size();
    ++samples;
    if (time_s > 10) time_s = 0;
  }
  if (chosen != std::min<std::uint64_t>(voices, pool.size()))
    state.SkipWithError("voices are missing");
  state.counters["nodes"] =
      static_cast<double>(pool.nodes_visited() - before) / static_cast<double>(samples);
  if (pool.size() > kMostToScan) return;
  SourceList list(field, weights, trees.all_sources());
  const auto scan = make_priority_sampler(field, weights, list, voices);
  time_s = 0;
  scan->sample(walk());
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 20; ++i) scan->sample(walk());
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
  state.counters["scan_ms"] = took.count() / 20;
}
BENCHMARK(query)
    ->ArgNames({"sources", "voices", "exponent"})
    ->ArgsProduct({{10'000}, {500, 2000}, {0}})
    ->ArgsProduct({{100'000}, {500, 2000, 20'000}, {0}})
    ->ArgsProduct({{1'000'000}, {500, 2000, 20'000}, {0, 20, 100}})
    ->ArgsProduct({{10'000'000}, {500, 2000, 20'000}, {0}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
