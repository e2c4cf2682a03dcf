// instances_benchmark.cpp: the number of emitters in a group from which instancing pays.
//
// 65536 fans in groups of a given size are baked with and without instances. Measured are the size
// of the file, the time of the bake, and the time of a sample with k = 2000 voices in the middle of
// the crowd.
#include <chrono>
#include <filesystem>

#include <benchmark/benchmark.h>

#include "bake/bake.h"
#include "formats/bake_file/bake_writer.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/stadium_level.h"

namespace clamor {
namespace {

constexpr std::uint32_t kFans = 65536;

void instances_sample(benchmark::State& state) {
  testing::StadiumLevel level;
  level.fans = static_cast<std::uint32_t>(state.range(0));
  level.stands = 16;
  level.blocks = kFans / level.fans / level.stands;
  level.build();
  BakeOptions options;
  if (state.range(1) != 0) options.groups = level.groups;
  const auto path = (std::filesystem::temp_directory_path() / "clamor_instances.clamor").string();
  const auto start = std::chrono::steady_clock::now();
  const auto contents = bake(level.level, options);
  if (!contents.ok() || !write_bake(path, *contents, 1).ok()) return state.SkipWithError("no bake");
  state.counters["bake_ms"] =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  const auto file = BakeFile::open(path);
  if (!file.ok()) return state.SkipWithError("no file");
  state.counters["file_kB"] = static_cast<double>(file->bytes().file) / 1e3;
  state.counters["trees"] = static_cast<double>(file->trees().size());

  const RadiationModel radiation(file->emitters(), file->materials(), Air{});
  SignalWeights weights;
  weights.by_signal.assign(file->signal_count(), same_in_all_bands(1));
  const SignalWeights ceilings = max_over_instances(weights, file->signal_maps());
  PageLoader loader(page_fetch(*file, radiation, ceilings), PageBudget{1'000'000'000});
  OctreePool pool(radiation, ceilings, file->trees(), file->signal_maps(), loader);
  const auto sampler = make_priority_sampler(radiation, weights, pool, 2000);
  sampler->sample(Vec3(0, 2, 0));
  while (!sampler->complete()) sampler->sample(Vec3(0, 2, 0));
  double x_m = 0, sum = 0;
  ListenerMotion motion(0.02);
  for (auto _ : state) {
    x_m += 0.05;
    for (const SampledSource& one : sampler->sample(motion.next(Vec3(x_m, 2, 0))))
      sum += one.power_scale;
  }
  benchmark::DoNotOptimize(sum);
  std::filesystem::remove(path);
}
BENCHMARK(instances_sample)
    ->ArgNames({"fans", "instances"})
    ->ArgsProduct({{2, 4, 8, 16, 64, 256, 1024}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace clamor
