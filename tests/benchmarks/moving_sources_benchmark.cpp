// moving_sources_benchmark.cpp: cost of moving sources for the caller who moves all of them, and
// for the keyframe that samples them.
//
// All n sources move in every keyframe, in a room of 200 x 200 m; k = 2000 are sampled. The time is
// that of one sample; `caller_ms` is the time of moving and committing all sources on the caller's
// thread.
#include <chrono>

#include <benchmark/benchmark.h>

#include "common/random.h"
#include "runtime/probes/combined_pool.h"
#include "runtime/sampling/moving_source_list.h"
#include "runtime/sampling/sampler.h"

namespace clamor {
namespace {

void moving_keyframe(benchmark::State& state) {
  const auto count = static_cast<std::uint32_t>(state.range(0));
  const std::vector<Emitter> emitters(1);
  const RadiationModel radiation(emitters, {}, Air{});
  SignalWeights weights;
  weights.by_signal = {same_in_all_bands(1)};
  MovingSources moving(count, 1);
  MovingSourceList list(moving, radiation, weights, emitters, 1);
  SourceList none(radiation, weights, {});
  CombinedPool pool({&none, &list});
  const auto sampler = make_priority_sampler(radiation, weights, pool, 2000);
  std::vector<MovingHandle> handles;
  const auto place = [](std::uint32_t i, double time_s) {
    const RandomBits bits = philox(8, {i, 0, 0, 0});
    return Vec3(200 * unit(bits[0]) + time_s, 2, 200 * unit(bits[1]));
  };
  for (std::uint32_t i = 0; i < count; ++i) handles.push_back(*moving.add({}));
  double time_s = 0, caller_ms = 0;
  for (auto step : state) {
    (void)step;
    state.PauseTiming();
    time_s += 0.02;
    std::vector<Vec3> places;
    for (std::uint32_t i = 0; i < count; ++i) places.push_back(place(i, time_s));
    const auto start = std::chrono::steady_clock::now();
    for (std::uint32_t i = 0; i < count; ++i) (void)moving.move(handles[i], places[i], {1, 0, 0});
    moving.commit(time_s);
    caller_ms +=
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    state.ResumeTiming();
    benchmark::DoNotOptimize(
        sampler->sample({Vec3(100 + time_s, 1.7, 100), {}, Vec3(1, 0, 0)}, time_s).size());
  }
  state.counters["caller_ms"] = caller_ms / static_cast<double>(state.iterations());
}
BENCHMARK(moving_keyframe)->Arg(1000)->Arg(10'000)->Arg(100'000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
