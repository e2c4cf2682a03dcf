// interface_benchmark.cpp: what calling the mixer through clamor.h adds to mixing.
//
// Two listeners of the same bake play the same keyframes: one is an auralizer, the other one of the
// C interface. They render blocks in turn, and each block is compared. `interface_percent` is the
// median of what a block of clamor_render() takes beyond one of the mixer, in per cent of the
// latter; it is noise as long as the cost is below it. `call_percent` is the time of a call for no
// frames, which does all that the interface does and mixes nothing, in per cent of a block's.
#include <algorithm>
#include <chrono>
#include <memory>
#include <vector>

#include <benchmark/benchmark.h>

#include "formats/bake_file/bake_file.h"
#include "runtime/clamor.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "tests/benchmarks/hall_file.h"

namespace clamor {
namespace {

constexpr int kInterfaceVoices = 2000;
const Listener kInterfacePlace(Vec3(10, 1.7, 7));

double elapsed_us(std::chrono::steady_clock::time_point since) {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - since)
      .count();
}

double median(std::vector<double> times) {
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2),
                   times.end());
  return times[times.size() / 2];
}

std::unique_ptr<Auralizer> direct_listener(const std::string& path) {
  AuralizerOptions options;
  options.voices = kInterfaceVoices;
  options.wait_for_pages = true;
  options.own_threads = false;
  options.sampler_period_s = 1.0 / 30;
  options.block_frames = 1024;
  return *Auralizer::create(std::make_shared<const BakeFile>(*BakeFile::open(path)), options);
}

void interface_cost(benchmark::State& state) {
  const testing::HallFile hall(20'000);
  const auto frames = static_cast<std::size_t>(state.range(0));
  const auto direct = direct_listener(hall.path);
  clamor_context* context = nullptr;
  clamor_level level = 0;
  clamor_listener listener = 0;
  clamor_options options{};
  options.bytes = sizeof(options);
  options.caller_updates = 1;
  clamor_listener_options wanted{};
  wanted.bytes = sizeof(wanted);
  wanted.output = CLAMOR_OUTPUT_RECEIVERS;
  wanted.voices = kInterfaceVoices;
  wanted.offline = 1;
  wanted.pose = {{10, 1.7, 7}, {0, 0, 0, 1}};
  if (clamor_create(&options, &context, nullptr) != CLAMOR_OK ||
      clamor_open_level(context, hall.path.c_str(), &level, nullptr) != CLAMOR_OK ||
      clamor_create_listener(context, level, &wanted, &listener, nullptr) != CLAMOR_OK)
    return state.SkipWithError("the hall cannot be played");
  std::vector<float> mixed(2 * frames), rendered(2 * frames);
  std::vector<double> mixing_us, more_us, calling_us;
  const auto mix = [&] {
    const auto start = std::chrono::steady_clock::now();
    direct->mix(mixed);
    return elapsed_us(start);
  };
  const auto render = [&] {
    const auto start = std::chrono::steady_clock::now();
    clamor_render(context, listener, rendered.data(), static_cast<std::uint32_t>(frames));
    return elapsed_us(start);
  };
  bool direct_first = false;
  for (auto _ : state) {
    while (direct->wants_keyframe()) direct->make_keyframe(kInterfacePlace);
    for (std::uint32_t made = 1; made > 0;) clamor_update(context, 0, &made);
    direct_first = !direct_first;
    const double first_us = direct_first ? mix() : render();
    const double second_us = direct_first ? render() : mix();
    mixing_us.push_back(direct_first ? first_us : second_us);
    more_us.push_back(direct_first ? second_us - first_us : first_us - second_us);
    constexpr int kCalls = 100;
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < kCalls; ++i) clamor_render(context, listener, rendered.data(), 0);
    calling_us.push_back(elapsed_us(start) / kCalls);
    if (mixed != rendered) return state.SkipWithError("the two render different samples");
  }
  state.counters["mixing_us"] = median(mixing_us);
  state.counters["interface_percent"] = 100 * median(more_us) / median(mixing_us);
  state.counters["call_percent"] = 100 * median(calling_us) / median(mixing_us);
  clamor_destroy(context);
}
BENCHMARK(interface_cost)
    ->Arg(64)
    ->Arg(256)
    ->Arg(1024)
    ->Iterations(500)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
