// keyframe_benchmark.cpp: cost of a keyframe of 20 000 sampled voices on the sampler thread, which
// must not be late.
//
// The sources lie on the walls of a hall, each with its own power in each band and a rank, as the
// default strategy gives it. "moving": the listener walks 2 cm and turns by a degree per keyframe,
// so every voice is updated; "still": nothing changes; "plainly": the reference of the tests makes
// one voice after another. The hand-over by the queue is included. Times are CPU time, "per_voice"
// in ns.
#include <cmath>
#include <memory>

#include <benchmark/benchmark.h>

#include "common/random.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/voices/keyframe_queue.h"
#include "tests/runtime/mixing/keyframe_reference.h"

namespace clamor {
namespace {

constexpr std::uint32_t kVoices = 20000;

double random_unit(std::uint32_t source, std::uint32_t use) {
  return unit(philox(3, {source, use, 0, 0})[0]);
}

// Makes keyframes with `make`(maker, sample, listener, keyframe).
template <class Maker, class Make, class... Args>
void keyframe(benchmark::State& state, bool moving, const Make& make, const Args&... args) {
  const std::vector<Emitter> emitters = {Emitter{.name = "source", .position_m = {10, 1.7, 12}}};
  std::vector<Material> materials(1);
  materials[0].scattering = same_in_all_bands(0.5f);
  const RadiationModel radiation(emitters, materials, Air{});
  std::vector<Source> sources(kVoices);
  std::vector<SampledSource> sample(kVoices);
  for (std::uint32_t i = 0; i < kVoices; ++i) {
    Source& source = sources[i];
    const auto axis = static_cast<int>(i % 3);
    Vec3f place(random_unit(i, 0), random_unit(i, 1), random_unit(i, 2)), normal(0);
    place[axis] = static_cast<float>(i / 3 % 2);
    normal[axis] = place[axis] > 0 ? -1.0f : 1.0f;
    source.position_m = place * Vec3f(20, 8, 15);
    source.normal = normal;
    source.mirror = normalize(normal + 0.5f * Vec3f(random_unit(i, 3), random_unit(i, 4), 0));
    source.delay_s = static_cast<float>(random_unit(i, 5));
    for (std::uint32_t b = 0; b < kBandCount; ++b)
      source.power[b] = static_cast<float>(random_unit(i, 6 + b) / kVoices);
    sample[i] = {i, 1.0, &source, 0, {}, random_unit(i, 20)};
  }
  Maker maker(radiation, kVoices, args...);
  KeyframeQueue queue(2, kVoices);
  ListenerMotion motion(kKeyframe_s);
  double turn = 0;
  for (auto _ : state) {
    if (moving) turn += 0.017;
    const Listener listener =
        motion.next({{8 + 1.2 * std::cos(turn), 1.7, 7 + 1.2 * std::sin(turn)}, turn, 0});
    Keyframe* const next = queue.writable();
    make(maker, sample, listener, *next);
    queue.publish();
    if (queue.readable()->voices.size() != kVoices) state.SkipWithError("voices are missing");
    queue.release();
  }
  state.counters["per_voice"] = benchmark::Counter(
      1e-9 * kVoices, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

using Receivers = KeyframeMaker::Receivers;

const auto kOmnidirectional = [](auto& maker, const auto& sample, const Listener& listener,
                                 Keyframe& keyframe) { maker.make(sample, listener, keyframe); };
const auto kCardioids = [](KeyframeMaker& maker, const auto& sample, const Listener& listener,
                           Keyframe& keyframe) {
  static const ReceiverPattern kOrtf = *ReceiverPattern::named("ortf");
  maker.make(sample, listener, keyframe, Reception(kOrtf, listener));
};

void moving(benchmark::State& state) { keyframe<KeyframeMaker>(state, true, kOmnidirectional); }
void moving_binaural(benchmark::State& state) {
  keyframe<KeyframeMaker>(state, true, kOmnidirectional, Receivers::kOne, *Hrtf::read(""));
}
void moving_cardioids(benchmark::State& state) { keyframe<KeyframeMaker>(state, true, kCardioids); }
void still(benchmark::State& state) { keyframe<KeyframeMaker>(state, false, kOmnidirectional); }
void moving_plainly(benchmark::State& state) {
  keyframe<testing::KeyframeReference>(state, true, kOmnidirectional);
}
void moving_binaural_plainly(benchmark::State& state) {
  keyframe<testing::KeyframeReference>(state, true, kOmnidirectional, Receivers::kOne,
                                       *Hrtf::read(""));
}
BENCHMARK(moving)->Name("keyframe/moving")->Unit(benchmark::kMillisecond);
BENCHMARK(moving_cardioids)->Name("keyframe/moving_cardioids")->Unit(benchmark::kMillisecond);
BENCHMARK(moving_plainly)->Name("keyframe/moving_plainly")->Unit(benchmark::kMillisecond);
BENCHMARK(moving_binaural)->Name("keyframe/moving_binaural")->Unit(benchmark::kMillisecond);
BENCHMARK(moving_binaural_plainly)
    ->Name("keyframe/moving_binaural_plainly")
    ->Unit(benchmark::kMillisecond);
BENCHMARK(still)->Name("keyframe/still")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
