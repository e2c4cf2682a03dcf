// city_benchmark.cpp: a billion sources, instanced from a few thousand (tests/city.h): opening the
// file, and sampling 2000 of them for a listener who walks. Times are one thread's CPU time.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include "formats/bake_file/bake_writer.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/benchmarks/sample_times.h"
#include "tests/city.h"

namespace clamor {
namespace {

// A file of `stadiums` stadiums, of ten million sources each.
const std::string& city_file(std::uint32_t stadiums) {
  struct Written {
    std::uint32_t stadiums = 0;
    std::string path = (std::filesystem::temp_directory_path() /
                        ("clamor_city_benchmark_" + std::to_string(::getpid()) + ".clamor"))
                           .string();
    ~Written() { std::filesystem::remove(path); }
  };
  static Written written;
  if (written.stadiums != stadiums) {
    testing::CitySize size;
    size.stadiums = stadiums;
    if (!write_bake(written.path, testing::city(size, 1), 1).ok()) std::abort();
    written.stadiums = stadiums;
  }
  return written.path;
}

void city_open(benchmark::State& state) {
  const std::string& path = city_file(static_cast<std::uint32_t>(state.range(0)));
  std::uint64_t sources = 0;
  for (auto _ : state) {
    const auto file = BakeFile::open(path);
    if (!file.ok()) return state.SkipWithError(file.error().message.c_str());
    const auto page = file->read_page(*file->top());
    if (!page.ok()) return state.SkipWithError(page.error().message.c_str());
    sources = file->source_count();
  }
  state.counters["sources"] = static_cast<double>(sources);
  state.counters["file_MB"] = static_cast<double>(std::filesystem::file_size(path)) / 1e6;
}
BENCHMARK(city_open)->ArgName("stadiums")->Arg(1)->Arg(100)->Unit(benchmark::kMillisecond);

void city_sample(benchmark::State& state) {
  const auto stadiums = static_cast<std::uint32_t>(state.range(0));
  const auto file = BakeFile::open(city_file(stadiums));
  if (!file.ok()) return state.SkipWithError(file.error().message.c_str());
  const RadiationModel radiation(file->emitters(), file->materials(), Air{});
  SignalWeights weights;
  weights.by_signal = {
      {1, 2, 3, 4, 5, 4, 3, 2}, {2, 2, 1, 1, 1, 1, 2, 2}, {1, 1, 1, 4, 4, 1, 1, 1}};
  const SignalWeights ceilings = max_over_instances(weights, file->signal_maps());
  PageLoader loader(page_fetch(*file, radiation, ceilings), PageBudget{20'000'000});
  OctreePool pool(radiation, ceilings, file->trees(), file->signal_maps(), loader);
  const auto sampler =
      make_priority_sampler(radiation, weights, pool, static_cast<std::size_t>(state.range(1)));
  double time_s = 0;
  ListenerMotion motion(0.02);
  const auto walk = [&] {
    time_s += 0.02;
    return motion.next(Vec3(700 + 1.5 * time_s, 2, 700));
  };
  for (int i = 0; i < 50; ++i) {
    const Listener listener = walk();
    sampler->sample(listener);
    while (!sampler->complete()) sampler->sample(listener);
  }
  const std::uint64_t pages_before = pool.nodes_visited();
  const std::uint64_t entries_before = pool.sources_tested() + pool.representatives_found();
  std::uint64_t samples = 0;
  testing::SampleTimes times;
  for (auto _ : state) {
    times.time([&] { benchmark::DoNotOptimize(sampler->sample(walk())); });
    ++samples;
  }
  const auto per_sample = [&](std::uint64_t count) {
    return static_cast<double>(count) / static_cast<double>(samples);
  };
  times.report(state);
  state.counters["pages"] = per_sample(pool.nodes_visited() - pages_before);
  state.counters["entries"] =
      per_sample(pool.sources_tested() + pool.representatives_found() - entries_before);
  state.counters["pages_MB"] = static_cast<double>(loader.statistics().bytes) / 1e6;
}
BENCHMARK(city_sample)
    ->ArgNames({"stadiums", "voices"})
    ->ArgsProduct({{1, 10, 100}, {500, 2000, 20'000}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
