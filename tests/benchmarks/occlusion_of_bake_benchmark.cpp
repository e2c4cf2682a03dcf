// occlusion_of_bake_benchmark.cpp: cost of occlusion per keyframe in the bake that CLAMOR_BAKE
// names, with its sounds, materials and surfaces.
//
// The listener walks back and forth through the middle, after a first walk that loads all pages.
// The walk is repeated five times, and `min_ms` is the median over keyframes of the shortest time
// of each: other work of the machine varies between walks, the keyframe does not. Other counters
// are those of occlusion_benchmark.cpp.
#include <cmath>
#include <memory>

#include <benchmark/benchmark.h>

#include "formats/bake_file/bake_file.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/benchmarks/hall_file.h"
#include "tests/benchmarks/keyframe_times.h"

namespace clamor {
namespace {

constexpr int kWalks = 5;

// A listener who walks back and forth through the middle of a bake.
class BakeListener {
 public:
  BakeListener(const BakeFile& file, const RadiationModel& radiation, const SignalWeights& weights,
               const SignalWeights& bounds, VisibilityCache& cache)
      : low_m_(file.top()->low_m),
        high_m_(file.top()->high_m),
        loader_(page_fetch(file, radiation, bounds), PageBudget{4'000'000'000}),
        pool_(radiation, bounds, file.trees(), file.signal_maps(), loader_),
        sampler_(make_priority_sampler(radiation, weights, pool_, 2000, &cache)) {}

  void go_back() { path_m_ = 0; }
  // Samples until all pages of the next `keyframes` places are loaded.
  void load(int keyframes) {
    for (int i = 0; i < keyframes; ++i) {
      next();
      while (!sampler_->complete()) sampler_->sample(place(), time_s_);
    }
  }
  void next() {
    path_m_ += 0.03;
    time_s_ += 0.02;
    sampler_->sample(motion_.next(place()), time_s_);
  }

 private:
  Vec3 place() const {
    const Vec3 middle_m = (low_m_ + high_m_) / 2.0, reach_m = 0.3 * (high_m_ - low_m_);
    return {middle_m.x + reach_m.x * std::sin(path_m_ / reach_m.x), low_m_.y + 1.7,
            middle_m.z + 0.3 * reach_m.z * std::cos(path_m_ / reach_m.x)};
  }

  const Vec3 low_m_, high_m_;
  PageLoader loader_;
  OctreePool pool_;
  std::unique_ptr<Sampler> sampler_;
  ListenerMotion motion_{0.02};
  double path_m_ = 0, time_s_ = 10;
};

void occlusion_of_bake(benchmark::State& state) {
  const char* const path = testing::bake_to_measure();
  if (path == nullptr) return state.SkipWithError("CLAMOR_BAKE names no file");
  const auto file = BakeFile::open(path);
  if (!file.ok()) return state.SkipWithError(file.error().message.c_str());
  const auto tables = read_tables(*file);
  if (!tables.ok()) return state.SkipWithError(tables.error().message.c_str());
  const auto mesh = file->read_mesh();
  if (!mesh.ok()) return state.SkipWithError(mesh.error().message.c_str());
  const RadiationModel radiation(tables->emitters, tables->materials, tables->air);
  const SignalWeights weights = make_signal_weights(tables->envelopes);
  const SignalWeights bounds = max_over_instances(weights, file->signal_maps());
  const OcclusionGeometry surfaces(*mesh, tables->materials);
  const auto keyframes = static_cast<int>(state.max_iterations);
  testing::KeyframeTimes times;
  // Calls timed(keyframe), which calls keyframe() once for each keyframe.
  const auto walk = [&](const auto& timed) {
    VisibilityCache cache(surfaces, radiation.speed_of_sound_mps(),
                          {.rays_per_keyframe = static_cast<int>(state.range(0))});
    BakeListener listener(*file, radiation, weights, bounds, cache);
    listener.load(100 + keyframes);
    listener.go_back();
    listener.load(100);
    times.begin_walk();
    timed([&] { times.time(cache, [&] { listener.next(); }); });
  };
  for (int w = 1; w < kWalks; ++w)
    walk([&](const auto& keyframe) {
      for (int k = 0; k < keyframes; ++k) keyframe();
    });
  walk([&](const auto& keyframe) {
    for (auto _ : state) keyframe();
  });
  times.report(state);
  state.counters["min_ms"] = times.median_of_min_ms();
  state.counters["sources"] = static_cast<double>(file->top()->sources_below);
}
BENCHMARK(occlusion_of_bake)
    ->ArgNames({"rays"})
    ->Arg(kRaysPerKeyframe)
    ->Iterations(500)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
