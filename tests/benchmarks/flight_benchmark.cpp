// flight_benchmark.cpp: cost of a keyframe while a listener flies at 50 m/s through ten million
// sources, of which 64 MB fit into memory. It decides whether a player keeps up.
//
// The benchmark runs in real time like a player: a keyframe every 20 ms, with pages arriving
// meanwhile. `median_ms` and `p99_ms` are the sampler thread's CPU time for a whole keyframe, with
// or without occlusion; `asked`, `loaded`, `dropped` and `late` are pages per keyframe. With
// CLAMOR_BAKE=FILE the listener flies through that bake instead, around its middle.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/cpu_time.h"
#include "common/sample_rate.h"
#include "formats/bake_file/bake_file.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/streaming/page_loader.h"
#include "runtime/voices/keyframe.h"
#include "tests/benchmarks/hall_file.h"

namespace clamor {
namespace {

const testing::HallFile& hall() {
  static const testing::HallFile file(testing::bake_to_measure() != nullptr ? 1000 : 10'000'000, 8);
  return file;
}

// Flies in circles between these corners, 12 m above the lower one.
Listener flying(double time_s, const Vec3& low_m, const Vec3& high_m) {
  const double a = 0.4 * (high_m.x - low_m.x), b = 0.4 * (high_m.z - low_m.z);
  const double angle = 50 * time_s / std::sqrt((a * a + b * b) / 2);
  const Vec3 middle_m = (low_m + high_m) / 2.0;
  return {{middle_m.x + a * std::cos(angle), low_m.y + 12, middle_m.z + b * std::sin(angle)}, 0, 0};
}

void flight(benchmark::State& state) {
  const testing::HallFile& file = hall();
  if (!file.error.empty()) return state.SkipWithError(file.error.c_str());
  const char* const given = testing::bake_to_measure();
  auto opened = BakeFile::open(given != nullptr ? given : file.path);
  if (!opened.ok()) return state.SkipWithError(opened.error().message.c_str());
  const Vec3 low_m(opened->top()->low_m), high_m(opened->top()->high_m);
  AuralizerOptions options;
  options.voices = static_cast<int>(state.range(0));
  options.visibility = state.range(1) != 0;
  auto auralizer = Auralizer::create(std::make_shared<const BakeFile>(std::move(*opened)), options);
  if (!auralizer.ok()) return state.SkipWithError(auralizer.error().message.c_str());
  std::vector<double> took_ms;
  std::vector<float> block(2 * kKeyframeFrames);
  auto due = std::chrono::steady_clock::now();
  for (auto _ : state) {
    std::this_thread::sleep_until(due);
    due += std::chrono::microseconds(1'000'000LL * kKeyframeFrames / kSampleRate_hz);
    while ((*auralizer)->wants_keyframe()) {
      const double start_s = thread_time_s();
      (*auralizer)->make_keyframe(flying((*auralizer)->next_keyframe_time_s(), low_m, high_m));
      took_ms.push_back(1e3 * (thread_time_s() - start_s));
    }
    (*auralizer)->mix(block);
  }
  const PageStatistics pages = (*auralizer)->statistics().pages;
  const auto keyframes = static_cast<double>(took_ms.size());
  std::sort(took_ms.begin(), took_ms.end());
  state.counters["median_ms"] = took_ms[took_ms.size() / 2];
  state.counters["p99_ms"] = took_ms[took_ms.size() * 99 / 100];
  state.counters["asked"] = static_cast<double>(pages.asked) / keyframes;
  state.counters["loaded"] = static_cast<double>(pages.loaded) / keyframes;
  state.counters["dropped"] = static_cast<double>(pages.dropped) / keyframes;
  state.counters["late"] = static_cast<double>(pages.late) / keyframes;
}
BENCHMARK(flight)
    ->ArgNames({"voices", "visibility"})
    ->ArgsProduct({{500, 2000}, {0, 1}})
    ->Iterations(500)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
