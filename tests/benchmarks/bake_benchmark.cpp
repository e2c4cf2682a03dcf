// bake_benchmark.cpp: speed of the photon tracer relative to the hardware, which decides how long a
// bake takes.
//
// For each level, alternating within one run, in millions per second of one thread's CPU time
// (which excludes other work of the machine):
//
//   bare_M         rays of Embree alone, for the rays that the plain walk casts
//   plain_M        bounces of a minimal random walk: closest hit, random numbers, cosine law
//   full_M         bounces of the tracer: eight bands with different lobes, air, path weights,
//                  roulette, deposits written
//   full_of_plain  their ratio in the same round
//   two_of_one     throughput of two threads relative to one by the clock, so only meaningful on an
//                  idle machine
//   two_own_time   the same by CPU time: the cost of sharing caches and memory
//
// Values are medians over the rounds. The benchmark fails on wrong results: mean free paths of walk
// and tracer must be 4V/S in a closed level, the deposits of a run must be the same bytes on one
// thread and on two, and `checksum` of those bytes is the same on every machine.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <thread>
#include <vector>

#include <benchmark/benchmark.h>

#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "common/cpu_time.h"
#include "common/maths.h"
#include "common/random.h"
#include "formats/gltf/level_import.h"
#include "formats/level/walk_file.h"
#include "tests/benchmarks/bare_embree.h"
#include "tests/benchmarks/wall_times.h"
#include "tests/build_paths.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

using testing::Clock;
using testing::median;
using testing::seconds_since;

Material unlike_bands() {
  Material material = testing::uniform_material(0.1f, 0.2f, 20);
  material.absorption = {0.05f, 0.06f, 0.08f, 0.1f, 0.1f, 0.12f, 0.15f, 0.2f};
  material.phong = {1, 2, 4, 8, 16, 32, 64, 128};
  return material;
}

// A 20 x 8 x 15 m hall whose walls are grids with bumps of up to 10 cm: 12 cells^2 triangles.
Level bumpy_hall(std::uint32_t cells) {
  Level level = testing::shoebox({20, 8, 15}, unlike_bands(), {5, 2, 4});
  if (cells == 1) return level;
  const Mesh box = level.mesh;
  Mesh mesh;
  for (std::size_t face = 0; face < 6; ++face) {
    const auto corner = [&](std::size_t triangle, std::size_t k) {
      return box.vertices_m[box.triangles[2 * face + triangle][k]];
    };
    const Vec3f origin = corner(0, 0), across = corner(0, 1) - origin, up = corner(1, 2) - origin;
    const Vec3f normal = normalize(cross(across, up));
    const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
    for (std::uint32_t y = 0; y <= cells; ++y)
      for (std::uint32_t x = 0; x <= cells; ++x) {
        const bool edge = x == 0 || y == 0 || x == cells || y == cells;
        const auto bump = static_cast<float>(
            edge ? 0 : 0.1 * unit(philox(7, {static_cast<std::uint32_t>(face), x, y, 0})[0]));
        mesh.vertices_m.push_back(origin + across * (static_cast<float>(x) / cells) +
                                  up * (static_cast<float>(y) / cells) + normal * bump);
      }
    for (std::uint32_t y = 0; y < cells; ++y)
      for (std::uint32_t x = 0; x < cells; ++x) {
        const std::uint32_t a = first + y * (cells + 1) + x, b = a + cells + 1;
        mesh.triangles.push_back({a, a + 1, b + 1});
        mesh.triangles.push_back({a, b + 1, b});
      }
  }
  mesh.materials.assign(mesh.triangles.size(), 0);
  level.mesh = std::move(mesh);
  return level;
}

Level sponza() {
  ImportOptions options;
  options.emitters = {"name=source,signal=impulse,at=0,2,0"};
  auto imported = import_level(testing::shared_level("sponza.glb"), options);
  if (!imported.ok()) return {};
  imported->level.materials.assign(imported->level.materials.size(), unlike_bands());
  return std::move(imported->level);
}

struct PhotonWalk {
  std::uint64_t bounces = 0, legs = 0;  // legs lead from surface to surface
  double legs_m = 0, own_s = 0;
};

// Mean free path 4V/S of a closed level, from its triangles.
double mean_chord_m(const Mesh& mesh) {
  double six_volumes = 0, twice_area = 0;
  for (const auto& corners : mesh.triangles) {
    const Vec3 a = mesh.vertices_m[corners[0]], b = mesh.vertices_m[corners[1]];
    const Vec3 c = mesh.vertices_m[corners[2]];
    six_volumes += dot(a, cross(b, c));
    twice_area += length(cross(b - a, c - a));
  }
  return 4 * (std::abs(six_volumes) / 6) / (twice_area / 2);
}

// The FNV-1a hash.
std::uint64_t checksum_of(std::span<const Deposit> deposits) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto add = [&hash](auto value) {
    for (std::size_t i = 0; i < sizeof value; ++i)
      hash = (hash ^ reinterpret_cast<const unsigned char*>(&value)[i]) * 0x100000001b3u;
  };
  for (const Deposit& deposit : deposits) {
    add(deposit.position_m);
    add(deposit.mirror);
    add(deposit.delay_s);
    add(deposit.power);
    add(deposit.random);
  }
  return hash;
}

// Moves all photons from one surface to the next, with Lambertian reflection only.
PhotonWalk plain_walk(const Scene& scene, const Vec3f& start, std::uint32_t photons,
                      std::uint32_t bounces, std::vector<Ray>* record) {
  const double start_s = thread_time_s();
  PhotonWalk walk;
  std::vector<Ray> rays(photons);
  std::vector<SurfaceHit> hits(photons);
  const auto direction = [](const Vec3f& axis, const RandomBits& bits, bool sphere) {
    const float u = static_cast<float>(bits[0] >> 8) * 0x1p-24f;
    const SinCos turn = sin_cos_of_turn(static_cast<float>(bits[1] >> 8) * 0x1p-24f);
    const float cos_a = sphere ? 1 - 2 * u : std::sqrt(1 - u);
    const float sin_a = std::sqrt(std::max(0.0f, 1 - cos_a * cos_a));
    const float sign = axis.z < 0 ? -1.0f : 1.0f, a = -1 / (sign + axis.z), b = axis.x * axis.y * a;
    const float p = sin_a * turn.cos, q = sin_a * turn.sin;
    return Vec3f(axis.x * cos_a + (1 + sign * axis.x * axis.x * a) * p + b * q,
                 axis.y * cos_a + sign * b * p + (sign + axis.y * axis.y * a) * q,
                 axis.z * cos_a - sign * axis.x * p - axis.y * q);
  };
  for (std::uint32_t i = 0; i < photons; ++i)
    rays[i] = {start, direction({0, 1, 0}, philox(11, {i, 0, 0, 0}), true)};
  const auto offset_m = static_cast<float>(scene.offset_m());
  for (std::uint32_t bounce = 1; bounce <= bounces; ++bounce) {
    if (record != nullptr) record->insert(record->end(), rays.begin(), rays.end());
    scene.first_hits(rays, hits);
    for (std::uint32_t i = 0; i < photons; ++i) {
      const RandomBits bits = philox(11, {i, 0, bounce, 0});
      if (hits[i].material == SurfaceHit::kNone) {
        rays[i] = {start, direction({0, 1, 0}, bits, true)};
        continue;
      }
      ++walk.bounces;
      if (bounce > 1) {
        ++walk.legs;
        walk.legs_m += static_cast<double>(hits[i].distance_m);
      }
      rays[i].origin_m += rays[i].direction * hits[i].distance_m + hits[i].normal * offset_m;
      rays[i].direction = direction(hits[i].normal, bits, false);
    }
  }
  walk.own_s = thread_time_s() - start_s;
  return walk;
}

// A round of the benchmark traces so many runs.
constexpr std::uint32_t kRuns = 6;

// Results go into memory that is reused from run to run, as in a bake. `traced` holds the last run
// in the end.
PhotonWalk full_trace(const PhotonTracer& tracer, std::uint64_t first, TracedRuns& traced) {
  const double start_s = thread_time_s();
  PhotonWalk walk;
  for (std::uint32_t i = 0; i < kRuns; ++i) {
    const PhotonRun run{0, first + std::uint64_t{i} * kRunPhotons, kRunPhotons};
    traced.clear();
    tracer.trace({&run, 1}, traced);
    const TraceTally& tally = traced.runs()[0].tally;
    walk.bounces += tally.bounces;
    walk.legs += tally.legs;
    walk.legs_m += tally.legs_m;
    benchmark::DoNotOptimize(traced.deposits().data());
  }
  walk.own_s = thread_time_s() - start_s;
  return walk;
}

double rate_M(const PhotonWalk& walk) {
  return static_cast<double>(walk.bounces) / walk.own_s / 1e6;
}

// Results of each round.
struct Rounds {
  std::vector<double> bare_M, plain_M, full_M, ratio, two, two_own;
  PhotonWalk plain, full;  // sums of legs

  void report(benchmark::State& state) const {
    state.counters["bare_M"] = median(bare_M);
    state.counters["plain_M"] = median(plain_M);
    state.counters["full_M"] = median(full_M);
    state.counters["full_of_plain"] = median(ratio);
    state.counters["two_of_one"] = median(two);
    state.counters["two_own_time"] = median(two_own);
  }
};

// Traces the same photons on one thread and then, with others beside them, on two. Returns whether
// both gave the same.
bool trace_on_one_and_two(const PhotonTracer& tracer, std::uint64_t first,
                          std::array<TracedRuns, 2>& kept, Rounds& rounds) {
  auto from = Clock::now();
  const PhotonWalk one = full_trace(tracer, first, kept[0]);
  const double one_clock_M = static_cast<double>(one.bounces) / seconds_since(from) / 1e6;
  const std::uint64_t alone = checksum_of(kept[0].deposits());
  rounds.full_M.push_back(rate_M(one));
  rounds.full.legs += one.legs;
  rounds.full.legs_m += one.legs_m;

  from = Clock::now();
  PhotonWalk left, right;
  std::thread other([&] { left = full_trace(tracer, first, kept[0]); });
  right = full_trace(tracer, first + std::uint64_t{kRuns} * kRunPhotons, kept[1]);
  other.join();
  const double both = static_cast<double>(left.bounces + right.bounces) / seconds_since(from);
  rounds.two.push_back(both / 1e6 / one_clock_M);
  rounds.two_own.push_back((rate_M(left) + rate_M(right)) / rate_M(one));
  return left.bounces == one.bounces && checksum_of(kept[0].deposits()) == alone;
}

void tracing(benchmark::State& state, const Level& level, bool closed) {
  if (level.mesh.triangles.empty()) {
    state.SkipWithError("the level is not here");
    return;
  }
  const Scene scene(level.mesh);
  const testing::BareEmbree bare(level.mesh);
  TraceSettings settings;
  settings.roulette_exponent = 0.15;
  settings.air_loss_per_m = air_loss_per_m(level.air);
  const PhotonTracer tracer(scene, level, settings);
  const Vec3f start(level.emitters[0].position_m);
  std::vector<Ray> rays;
  plain_walk(scene, start, 1024, 20, &rays);

  std::array<TracedRuns, 2> kept;
  full_trace(tracer, 0, kept[0]);  // touches the memory for the first time
  full_trace(tracer, 0, kept[1]);
  const std::uint64_t checksum = checksum_of(kept[0].deposits());
  Rounds rounds;
  std::uint64_t first = 0;
  for (auto _ : state) {
    rounds.bare_M.push_back(static_cast<double>(rays.size()) / bare.seconds(rays) / 1e6);
    const PhotonWalk plain = plain_walk(scene, start, 1024, 60, nullptr);
    rounds.plain_M.push_back(rate_M(plain));
    rounds.plain.legs += plain.legs;
    rounds.plain.legs_m += plain.legs_m;
    if (!trace_on_one_and_two(tracer, first, kept, rounds))
      state.SkipWithError("two threads trace other paths than one");
    rounds.ratio.push_back(rounds.full_M.back() / rounds.plain_M.back());
    first += 2 * std::uint64_t{kRuns} * kRunPhotons;
  }
  // The standard error of a million legs is 0.1 %. Within the hollows of bumps the field becomes
  // diffuse only after some bounces.
  if (closed)
    for (const PhotonWalk* walk : {&rounds.plain, &rounds.full})
      if (std::abs(walk->legs_m / static_cast<double>(walk->legs) / mean_chord_m(level.mesh) - 1) >
          0.02)
        state.SkipWithError("the mean free path is not 4V/S");
  state.counters["triangles"] = static_cast<double>(level.mesh.triangles.size());
  rounds.report(state);
  state.counters["checksum"] = static_cast<double>(checksum % 1'000'000);
}

// Doors of 1 x 2 m, evenly over the floor of the hall.
std::vector<Portal> doors(std::size_t count) {
  std::vector<Portal> portals;
  const auto columns = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  for (std::size_t i = 0; i < count; ++i) {
    const double x = 20 * (static_cast<double>(i % columns) + 0.5) / static_cast<double>(columns);
    const double z = 15 * (static_cast<double>(i / columns) + 0.5) / static_cast<double>(columns);
    portals.push_back({"", {x, 1, z}, i % 2 == 0 ? Vec3(0.5, 0, 0) : Vec3(0, 0, 0.5), {0, 1, 0}});
  }
  return portals;
}

// `time_ratio`: CPU time of tracing with portals over that without, in the same rounds.
void tracing_portals(benchmark::State& state, const Level& level) {
  const Scene scene(level.mesh);
  Level with = level;
  with.portals = doors(static_cast<std::size_t>(state.range(0)));
  TraceSettings settings;
  settings.roulette_exponent = 0.15;
  const PhotonTracer plain(scene, level, settings), tracer(scene, with, settings);
  TracedRuns kept;
  full_trace(plain, 0, kept);
  std::vector<double> ratios;
  std::uint64_t first = 0;
  for (auto _ : state) {
    const double without_M = rate_M(full_trace(plain, first, kept));
    ratios.push_back(without_M / rate_M(full_trace(tracer, first, kept)));
    first += std::uint64_t{kRuns} * kRunPhotons;
  }
  std::size_t passed = 0;
  for (const Deposit& deposit : kept.deposits()) passed += !deposit.portals.is_empty();
  state.counters["time_ratio"] = median(ratios);
  state.counters["passed"] =
      static_cast<double>(passed) / static_cast<double>(kept.deposits().size());
}

BENCHMARK_CAPTURE(tracing_portals, box, bumpy_hall(1))
    ->Arg(1)
    ->Arg(100)
    ->Arg(1024)
    ->Iterations(15)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(tracing_portals, hall_70k, bumpy_hall(76))
    ->Arg(1)
    ->Arg(100)
    ->Arg(1024)
    ->Iterations(9)
    ->Unit(benchmark::kMillisecond);

BENCHMARK_CAPTURE(tracing, box, bumpy_hall(1), true)->Iterations(15)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(tracing, hall_70k, bumpy_hall(76), true)
    ->Iterations(9)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(tracing, sponza, sponza(), false)->Iterations(9)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(tracing, hall_1M, bumpy_hall(300), true)
    ->Iterations(7)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
