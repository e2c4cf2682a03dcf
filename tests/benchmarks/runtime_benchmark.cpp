// runtime_benchmark.cpp: cost of a listener, which decides how many voices and sources are
// affordable.
//
// "x_real_time" is the speed of one core relative to real time; playback needs well above 1.
// Results are checked: a sum over the output is reported and must be above zero.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/random.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/player/render.h"
#include "runtime/voices/keyframe.h"

namespace clamor {
namespace {

// Sources on the walls of a 20 x 8 x 15 m hall with powers spread over 60 dB, as after many
// bounces. They are ordered by cells, like pages of an octree.
AuralizerInput hall(std::uint32_t sources) {
  AuralizerInput input;
  Signal noise;
  noise.name = "noise";
  for (std::uint32_t i = 0; i < 2 * kSampleRate_hz; ++i)
    noise.samples.push_back(static_cast<float>(unit(philox(1, {i, 0, 0, 0})[0]) - 0.5));
  input.signals = {std::move(noise)};
  input.emitters = {Emitter{.name = "source", .position_m = {10, 1.7, 12}}};
  input.materials.resize(1);
  input.materials[0].scattering = same_in_all_bands(0.5f);
  const Vec3 size_m(20, 8, 15);
  const auto per_side = static_cast<std::uint32_t>(std::ceil(std::sqrt(sources / 6.0)));
  for (std::uint32_t i = 0; i < sources; ++i) {
    const RandomBits a = philox(2, {i, 0, 0, 0}), b = philox(2, {i, 1, 0, 0});
    const std::uint32_t face = i % 6, cell = i / 6;
    const int axis = static_cast<int>(face / 2);
    Vec3 place(0), normal(0), mirror(0);
    place[(axis + 1) % 3] = (cell % per_side + unit(a[0])) / per_side;
    place[(axis + 2) % 3] = (cell / per_side + unit(a[1])) / per_side;
    place[axis] = face % 2;
    normal[axis] = face % 2 == 0 ? 1 : -1;
    const double cos_i = std::sqrt(unit_above_zero(a[2])), turn = 2 * std::numbers::pi * unit(a[3]);
    mirror = normal * cos_i;
    mirror[(axis + 1) % 3] = std::sqrt(1 - cos_i * cos_i) * std::cos(turn);
    mirror[(axis + 2) % 3] = std::sqrt(1 - cos_i * cos_i) * std::sin(turn);
    Source source;
    source.position_m = Vec3f(place * size_m);
    source.normal = Vec3f(normal);
    source.mirror = Vec3f(mirror);
    source.delay_s = static_cast<float>(0.02 + 1.5 * unit(b[0]));
    source.power = same_in_all_bands(static_cast<float>(std::pow(10, -6 * unit(b[0]))));
    source.patch_radius_m = 0.3f;
    source.u = static_cast<float>(unit_above_zero(b[1]));
    source.polarity = b[2] & 1 ? 1 : -1;
    input.sources.push_back(source);
  }
  return input;
}

// Orders sources cell by cell and face by face into blocks of neighbours, as the octree does.
std::unique_ptr<Auralizer> listener(std::uint32_t sources, int voices) {
  AuralizerInput input = hall(sources);
  std::stable_sort(
      input.sources.begin(), input.sources.end(), [](const Source& a, const Source& b) {
        const auto cell = [](const Source& s) {
          return std::array{std::floor(s.position_m.x / 2), std::floor(s.position_m.y / 2),
                            std::floor(s.position_m.z / 2)};
        };
        return cell(a) < cell(b);
      });
  AuralizerOptions options;
  options.voices = voices;
  return std::move(*Auralizer::create(std::move(input), options));
}

Listener walking(double time_s) {
  return {{10 + 6 * std::sin(time_s / 6), 1.7, 7 + 4 * std::cos(time_s / 6)}, time_s / 3, 0};
}

void mix(benchmark::State& state) {
  const auto voices = static_cast<int>(state.range(0));
  const auto auralizer = listener(static_cast<std::uint32_t>(2 * voices), voices);
  std::vector<float> block(kKeyframeFrames * kOutputChannels);
  double time_s = 0, energy = 0;
  for (auto _ : state) {
    state.PauseTiming();
    while (auralizer->wants_keyframe())
      auralizer->make_keyframe(walking(auralizer->next_keyframe_time_s()));
    state.ResumeTiming();
    auralizer->mix(block);
    for (const float sample : block) energy += static_cast<double>(sample) * sample;
    time_s += static_cast<double>(kKeyframeFrames) / kSampleRate_hz;
  }
  if (!(energy > 0)) state.SkipWithError("nothing was heard");
  state.counters["x_real_time"] = benchmark::Counter(time_s, benchmark::Counter::kIsRate);
}
BENCHMARK(mix)->ArgName("voices")->Arg(150)->Arg(2000)->Arg(20000)->Unit(benchmark::kMillisecond);

void keyframe(benchmark::State& state) {
  const auto auralizer = listener(static_cast<std::uint32_t>(state.range(0)), 2000);
  const bool walks = state.range(1) != 0;
  std::vector<float> block(kKeyframeFrames * kOutputChannels);
  while (auralizer->wants_keyframe()) auralizer->make_keyframe(walking(0));
  for (auto _ : state) {
    state.PauseTiming();
    auralizer->mix(block);
    const Listener pose = walking(walks ? auralizer->next_keyframe_time_s() : 0);
    state.ResumeTiming();
    auralizer->make_keyframe(pose);
  }
  const AuralizerStatistics statistics = auralizer->statistics();
  if (statistics.voices < 2000) state.SkipWithError("voices are missing");
  state.counters["voices"] = statistics.voices;
}
BENCHMARK(keyframe)
    ->ArgNames({"sources", "walks"})
    ->ArgsProduct({{10000, 100000, 1000000}, {1, 0}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
