// intensity_benchmark.cpp: cost of a source's intensity at a place.
//
// Sources on walls with a lobe of exponent 20 are evaluated by the thousand, as in sampling: in
// batches by the kernel (intensity_kernel.h) and one by one in double precision
// (received_intensity.h), alternating. `exact_ns` and `kernel_ns` are per source, `alone_ns` for a
// batch of one, and `exact_of_kernel` is their ratio.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/random.h"
#include "runtime/propagation/radiation_model.h"

namespace clamor {
namespace {

constexpr std::uint32_t kSources = 4000;
constexpr Vec3 kPlace(0, 1.7, 0);

std::vector<Source> wall_sources() {
  std::vector<Source> sources(kSources);
  for (std::uint32_t i = 0; i < kSources; ++i) {
    const RandomBits a = philox(2, {i, 0, 0, 0}), b = philox(2, {i, 1, 0, 0});
    Source& source = sources[i];
    source.position_m = Vec3f(20 * unit(a[0]) - 10, 10 * unit(a[1]), 10 * unit(a[2]) - 5);
    const Vec3 off = Vec3(unit(b[0]) - 0.5, unit(b[1]) - 0.5, unit(b[2]) - 0.5);
    const Vec3 normal = normalize(normalize(kPlace - Vec3(source.position_m)) + 0.7 * off);
    source.normal = Vec3f(normal);
    source.mirror = Vec3f(normalize(1.5 * normal + Vec3(off.z, off.x, off.y)));
    source.power = same_in_all_bands(1);
    source.patch_radius_m = 0.3f;
  }
  return sources;
}

void intensity(benchmark::State& state) {
  std::vector<Material> materials(1);
  materials[0].scattering = {0.05f, 0.05f, 0.07f, 0.1f, 0.15f, 0.2f, 0.3f, 0.4f};
  materials[0].phong = same_in_all_bands(20);
  const std::vector<Emitter> emitters(1);
  const RadiationModel radiation(emitters, materials, Air{});
  const std::vector<Source> sources = wall_sources();
  std::vector<const Source*> all;
  for (const Source& source : sources) all.push_back(&source);
  std::vector<ReceivedIntensity> received(kSources);
  double exact_ns = 1e9, kernel_ns = 1e9, alone_ns = 1e9;
  const auto time = [](double& min_ns, const auto& run) {
    const auto start = std::chrono::steady_clock::now();
    run();
    const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - start;
    min_ns = std::min(min_ns, took.count() / kSources);
  };
  for (auto _ : state) {
    time(exact_ns, [&] {
      for (std::uint32_t i = 0; i < kSources; ++i)
        received[i].intensity = received_intensity(sources[i], emitters, radiation.laws(),
                                                   radiation.air_loss_per_m(), kPlace);
    });
    benchmark::DoNotOptimize(received.data());
    time(alone_ns, [&] {
      for (std::uint32_t i = 0; i < kSources; ++i)
        received[i].intensity = radiation.intensity(sources[i], kPlace);
    });
    benchmark::DoNotOptimize(received.data());
    time(kernel_ns, [&] { radiation.receive(all, kPlace, received.data()); });
    benchmark::DoNotOptimize(received.data());
  }
  state.counters["exact_ns"] = exact_ns;
  state.counters["alone_ns"] = alone_ns;
  state.counters["kernel_ns"] = kernel_ns;
  state.counters["exact_of_kernel"] = exact_ns / kernel_ns;
}
BENCHMARK(intensity)->Iterations(100)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
