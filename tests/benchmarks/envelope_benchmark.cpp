// envelope_benchmark.cpp: changes of the sample for a listener at rest, because sources are
// weighted by the current level of their signals.
//
// A listener stands in the middle of a baked level for 20 s; CLAMOR_BAKE names the file, and
// without it nothing is measured. `exchanged_per_s` is the number of sources of the sample that are
// replaced per second, and `entries_percent` the same in percent of the sample; the time is that of
// one sample. Weights follow the moments of the envelope, their smoothing in signal_weights.h, or
// the mean.
#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "formats/bake_file/bake_file.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/propagation/loudness.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"

namespace clamor {
namespace {

enum Weighing { kSteady, kRaw, kSmooth, kSmoother, kSmoothest };

SignalWeights weights_for(Weighing weighing, const AuralizerInput& input) {
  if (weighing == kSmooth) return make_signal_weights(input.envelopes);
  if (weighing == kSmoother) return make_signal_weights(input.envelopes, {0.1, 0.3, 1});
  if (weighing == kSmoothest) return make_signal_weights(input.envelopes, {0.2, 0.6, 2});
  SignalWeights weights = make_signal_weights(input.envelopes, {0, 0, 0});
  if (weighing == kRaw) return weights;
  const Bands loudness = loudness_weights();
  weights.tracks.clear();
  for (std::size_t s = 0; s < input.envelopes.size(); ++s)
    for (std::size_t b = 0; b < kBandCount; ++b)
      weights.by_signal[s][b] = loudness[b] * input.envelopes[s].envelope.mean_square()[b];
  return weights;
}

void standing_still(benchmark::State& state) {
  const char* const path = std::getenv("CLAMOR_BAKE");
  if (path == nullptr) return state.SkipWithError("CLAMOR_BAKE names no file");
  const auto file = BakeFile::open(path);
  if (!file.ok()) return state.SkipWithError(file.error().message.c_str());
  const auto tables = read_tables(*file);
  if (!tables.ok()) return state.SkipWithError(tables.error().message.c_str());
  const RadiationModel radiation(tables->emitters, tables->materials, tables->air);
  const SignalWeights weights = weights_for(static_cast<Weighing>(state.range(0)), *tables);
  const SignalWeights ceilings = max_over_instances(weights, file->signal_maps());
  PageLoader loader(page_fetch(*file, radiation, ceilings), PageBudget{4'000'000'000});
  OctreePool pool(radiation, ceilings, file->trees(), file->signal_maps(), loader);
  const auto voices = static_cast<std::size_t>(state.range(1));
  const auto sampler = make_priority_sampler(radiation, weights, pool, voices);
  const bool walks = state.range(2) != 0;
  const PageEntry& root = *file->top();
  const Vec3 middle = (Vec3(root.low_m) + Vec3(root.high_m)) / 2.0;

  std::vector<std::uint64_t> before, now, entered;
  std::uint64_t exchanged = 0, chosen = 0;
  double time_s = 10;  // all signals have started
  sampler->sample(middle, time_s);
  while (!sampler->complete()) sampler->sample(middle, time_s);
  int keyframes = 0;
  ListenerMotion motion(0.02);
  for (auto _ : state) {
    const Vec3 place = walks ? middle + Vec3(0.03 * keyframes, 0, 0) : middle;
    const auto sample = sampler->sample(motion.next(place), time_s);
    state.PauseTiming();
    now.clear();
    for (const SampledSource& one : sample) now.push_back(one.number);
    if (keyframes > 0) {
      entered.clear();
      std::set_difference(now.begin(), now.end(), before.begin(), before.end(),
                          std::back_inserter(entered));
      exchanged += entered.size();
      chosen += now.size();
    }
    before = now;
    ++keyframes;
    time_s += 0.02;
    state.ResumeTiming();
  }
  state.counters["exchanged_per_s"] = static_cast<double>(exchanged) / (0.02 * (keyframes - 1));
  state.counters["percent_per_s"] =
      100.0 * static_cast<double>(exchanged) / static_cast<double>(chosen) / 0.02;
  state.counters["chosen"] = static_cast<double>(chosen) / (keyframes - 1);
}
BENCHMARK(standing_still)
    ->ArgNames({"weighing", "voices", "walks"})
    ->ArgsProduct({{kSteady, kRaw, kSmooth, kSmoother, kSmoothest}, {150, 2000}, {0, 1}})
    ->Iterations(500)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
