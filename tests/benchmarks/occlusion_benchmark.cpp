// occlusion_benchmark.cpp: cost of occlusion per keyframe, which decides the budget of rays.
//
// Ten million sources lie on the surfaces of Sponza (66 000 triangles; it comes with the levels
// beside the repository), with powers spread over 60 dB; a listener walks through it at 1.5 m/s. In
// a "plain" scene they play one steady signal and radiate uniformly; in a "full" one they reflect
// by the level's materials, each with its own angle of incidence, and play 16 signals with the
// levels of speech. `rays_ms` is the part of the keyframe that casts rays and `rest_ms` the median
// of everything else, which mostly waits for memory: `memory_ns` is the time of one read. `current`
// is the share of the relevant sources whose visibility was tested from the present cell, and
// `hidden` the occluded share; `free_ms` is a keyframe without occlusion.
//
//   sight_of_bake  the same in the bake that CLAMOR_BAKE names, with its sounds, materials and
//                  surfaces. The listener walks back and forth through the middle, after a first
//                  walk that loads all pages. The walk is repeated five times, and `least_ms` is
//                  the median over keyframes of the shortest time of each: other work of the
//                  machine varies between walks, the keyframe does not.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "bake/octree/octree_builder.h"
#include "common/random.h"
#include "common/thread_time.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/signal_envelope.h"
#include "formats/gltf/level_import.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/benchmarks/hall_file.h"
#include "tests/benchmarks/memory_latency.h"
#include "tests/build_paths.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

constexpr std::uint32_t kSignals = 16;
constexpr int kWalks = 5;

// Speech: syllables of 40 to 200 ms during 80 % of the time; all bands vary together.
TimedEnvelope speech(std::uint32_t seed) {
  constexpr std::size_t kMoments = 500;
  std::vector<std::uint8_t> steps(kBandCount * kMoments);
  for (std::size_t m = 0; m < kMoments; ++m) {
    const auto at = static_cast<std::uint32_t>(m / 6);
    const RandomBits bits = philox(seed, {at, static_cast<std::uint32_t>(m / 2 % 3), 7, 0});
    const double level = unit(bits[0]) < 0.2 ? 60 : 170 + 80 * unit(bits[1]);
    for (std::size_t b = 0; b < kBandCount; ++b)
      steps[b * kMoments + m] = static_cast<std::uint8_t>(level - 5 * unit(bits[2]));
    if (m == 250)
      for (std::size_t b = 0; b < kBandCount; ++b) steps[b * kMoments + m] = 255;
  }
  return {*SignalEnvelope::from_steps(same_in_all_bands(1), std::move(steps)),
          kMoments * kMomentFrames, true};
}

const std::string kSponza = std::string(testing::kSourceDir) + "/../shared/levels/sponza.glb";

std::vector<Source> surface_sources(const Mesh& mesh, std::uint32_t count, bool full) {
  std::vector<double> area(mesh.triangles.size());
  const auto corner = [&](std::size_t t, int c) {
    return Vec3(mesh.vertices_m[mesh.triangles[t][c]]);
  };
  for (std::size_t t = 0; t < area.size(); ++t)
    area[t] = length(cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0)));
  std::partial_sum(area.begin(), area.end(), area.begin());
  std::vector<Source> sources(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const RandomBits a = philox(2, {i, 0, 0, 0}), b = philox(2, {i, 1, 0, 0});
    const auto t = std::min<std::size_t>(
        area.size() - 1,
        std::upper_bound(area.begin(), area.end(), unit(a[0]) * area.back()) - area.begin());
    const double u = std::sqrt(unit(a[1])), v = unit(a[2]);
    const Vec3 across = cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0));
    if (length(across) == 0) continue;
    const Vec3 normal = (a[3] & 1 ? 1.0 : -1.0) * normalize(across);
    Source& source = sources[i];
    source.position_m =
        Vec3f((1 - u) * corner(t, 0) + u * (1 - v) * corner(t, 1) + u * v * corner(t, 2));
    source.normal = source.mirror = Vec3f(normal);
    if (full) {
      const Vec3 way(unit(b[2]) - 0.5, unit(b[3]) - 0.5, unit(a[3]) - 0.5);
      source.mirror = Vec3f(normalize(1.5 * normal + way));
      source.emitter = i % kSignals;
      source.material = mesh.materials[t];
    }
    source.delay_s = static_cast<float>(0.02 + 1.5 * unit(b[0]));
    source.power = same_in_all_bands(static_cast<float>(std::pow(10, -6 * unit(b[0]))));
    source.patch_radius_m = 0.3f;
    source.u = static_cast<float>(unit_above_zero(b[1]));
  }
  return sources;
}

// Times of keyframes without their rays, and of the rays: those of the last walk, and the shortest
// of each keyframe over repeated walks.
class KeyframeTimes {
 public:
  void begin_walk() {
    rest_ms_.clear();
    rays_ms_ = 0;
  }
  template <class Keyframe>
  void time(const VisibilityCache& cache, const Keyframe& keyframe) {
    const double start_s = thread_time_s(), cast_ms = cache.statistics().ray_ms;
    keyframe();
    const double ray_ms = cache.statistics().ray_ms - cast_ms;
    const double rest_ms = 1e3 * (thread_time_s() - start_s) - ray_ms;
    const std::size_t k = rest_ms_.size();
    if (k == least_ms_.size()) least_ms_.push_back(rest_ms);
    least_ms_[k] = std::min(least_ms_[k], rest_ms);
    rest_ms_.push_back(rest_ms);
    rays_ms_ += ray_ms;
  }

  void report(benchmark::State& state) {
    const auto count = static_cast<double>(rest_ms_.size());
    std::sort(rest_ms_.begin(), rest_ms_.end());
    state.counters["rays_ms"] = rays_ms_ / count;
    state.counters["rest_ms"] = rest_ms_[rest_ms_.size() / 2];
    state.counters["rest_mean_ms"] = std::accumulate(rest_ms_.begin(), rest_ms_.end(), 0.0) / count;
    state.counters["rest_p95_ms"] = rest_ms_[rest_ms_.size() * 19 / 20];
    state.counters["memory_ns"] = testing::memory_latency_ns();
  }

  double median_of_least_ms() const {
    std::vector<double> sorted = least_ms_;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }

 private:
  std::vector<double> rest_ms_, least_ms_;
  double rays_ms_ = 0;
};

void sight(benchmark::State& state) {
  if (!std::filesystem::exists(kSponza)) return state.SkipWithError("Sponza is not here");
  const auto level = import_level(kSponza, {});
  if (!level.ok()) return state.SkipWithError(level.error().message.c_str());
  const Mesh& mesh = level->level.mesh;
  const bool full = state.range(2) != 0;
  testing::StoredTrees trees;
  trees.add(build_octree(surface_sources(mesh, static_cast<std::uint32_t>(state.range(0)), full)));

  const std::vector<Material> materials = full ? level->level.materials : std::vector<Material>(1);
  std::vector<Emitter> emitters(full ? kSignals : 1);
  for (std::uint32_t e = 0; e < emitters.size(); ++e) emitters[e].signal = e;
  const RadiationModel field(emitters, materials, Air{});
  SignalWeights weights;
  weights.by_signal = {same_in_all_bands(1)};
  if (full) {
    std::vector<TimedEnvelope> envelopes;
    for (std::uint32_t s = 0; s < kSignals; ++s) envelopes.push_back(speech(s));
    weights = make_signal_weights(envelopes);
  }
  const OcclusionGeometry surfaces(mesh, level->level.materials);
  // ReceivedIntensity power per band.
  const auto heard = [&](std::span<const SampledSource> sample, const Vec3& place) {
    std::array<double, kBandCount> power{};
    for (const SampledSource& one : sample) {
      const Bands intensity = field.intensity(*one.source, place);
      for (std::size_t b = 0; b < kBandCount; ++b)
        power[b] += one.power_scale * static_cast<double>(intensity[b] * one.visibility[b]);
    }
    return power;
  };
  const auto run = [&](VisibilityCache* cache, auto&& timed) {
    PageLoader loader(trees.fetch(field, weights), PageBudget{4'000'000'000});
    OctreePool pool(field, weights, trees.tops(), {}, loader);
    const auto sampler = make_priority_sampler(field, weights, pool, 2000, cache);
    double way_m = 0, time_s = 10;  // all signals have started
    // Error per band in dB against a sample in which every source is tested from here.
    const auto off_db = [&] {
      const Vec3 place(9 * std::sin(way_m / 9), 1.7, 0.8 * std::cos(way_m / 5));
      const auto now = heard(sampler->sample(place, time_s), place);
      VisibilityCache all(surfaces, field.speed_of_sound_mps(), {.exact = true});
      PageLoader other_loader(trees.fetch(field, weights), PageBudget{4'000'000'000});
      OctreePool other_pool(field, weights, trees.tops(), {}, other_loader);
      const auto exact = make_priority_sampler(field, weights, other_pool, 2000, &all);
      exact->sample(place, time_s);
      while (!exact->complete()) exact->sample(place, time_s);
      const auto right = heard(exact->sample(place, time_s), place);
      double worst_db = 0;
      for (std::size_t b = 0; b < kBandCount; ++b)
        worst_db = std::max(worst_db, std::abs(10 * std::log10(now[b] / right[b])));
      return worst_db;
    };
    const auto walk = [&] {
      way_m += 0.03;
      time_s += 0.02;
      return Vec3(9 * std::sin(way_m / 9), 1.7, 0.8 * std::cos(way_m / 5));
    };
    for (int i = 0; i < 100; ++i) {
      const Vec3 place = walk();
      sampler->sample(place, time_s);
      while (!sampler->complete()) sampler->sample(place, time_s);
    }
    timed(
        [&] {
          const Vec3 place = walk();
          return sampler->sample(place, time_s);
        },
        off_db);
  };
  VisibilityCache cache(surfaces, field.speed_of_sound_mps(),
                        {.rays_per_keyframe = static_cast<int>(state.range(1))});
  double worst_db = 0, mean_db = 0;
  double voices = 0, wanted = 0, current = 0, frames = 0;
  VisibilityStatistics before;
  KeyframeTimes times;
  run(&cache, [&](const auto& keyframe, const auto& off_db) {
    before = cache.statistics();
    for (auto _ : state) {
      times.time(cache, [&] { voices += static_cast<double>(keyframe().size()); });
      wanted += static_cast<double>(cache.statistics().wanted);
      current += static_cast<double>(cache.statistics().current);
      ++frames;
      if (std::fmod(frames, 50) != 0) continue;
      state.PauseTiming();
      const double db = off_db();
      worst_db = std::max(worst_db, db);
      mean_db += db / 10;
      state.ResumeTiming();
    }
  });
  const VisibilityStatistics& after = cache.statistics();
  state.counters["voices"] = voices / frames;
  state.counters["rays"] = static_cast<double>(after.rays - before.rays) / frames;
  state.counters["looks"] = static_cast<double>(after.looks - before.looks) / frames;
  state.counters["line_tests"] = static_cast<double>(after.line_tests - before.line_tests) / frames;
  state.counters["late"] = static_cast<double>(after.late - before.late) / frames;
  state.counters["wanted"] = wanted / frames;
  state.counters["current"] = current / wanted;
  state.counters["worst_db"] = worst_db;
  state.counters["mean_db"] = mean_db;
  times.report(state);
  run(nullptr, [&](const auto& keyframe, const auto&) {
    const std::clock_t start = std::clock();
    for (int i = 0; i < 200; ++i) keyframe();
    state.counters["free_ms"] =
        1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / 200;
  });
}
BENCHMARK(sight)
    ->ArgNames({"sources", "rays", "full"})
    ->ArgsProduct({{100'000, 1'000'000, 10'000'000}, {kRaysPerKeyframe}, {0, 1}})
    ->ArgsProduct({{1'000'000}, {2000, 4000, 2 * kRaysPerKeyframe, 4 * kRaysPerKeyframe}, {0}})
    ->Iterations(500)
    ->Unit(benchmark::kMillisecond);

void sight_of_bake(benchmark::State& state) {
  const char* const path = testing::bake_to_measure();
  if (path == nullptr) return state.SkipWithError("CLAMOR_BAKE names no file");
  const auto file = BakeFile::open(path);
  if (!file.ok()) return state.SkipWithError(file.error().message.c_str());
  const auto tables = read_tables(*file);
  if (!tables.ok()) return state.SkipWithError(tables.error().message.c_str());
  const auto mesh = file->read_mesh();
  if (!mesh.ok()) return state.SkipWithError(mesh.error().message.c_str());
  const RadiationModel field(tables->emitters, tables->materials, tables->air);
  const SignalWeights weights = make_signal_weights(tables->envelopes);
  const SignalWeights ceilings = max_over_instances(weights, file->signal_maps());
  const OcclusionGeometry surfaces(*mesh, tables->materials);
  const Vec3 low_m(file->top()->low_m), high_m(file->top()->high_m);
  const Vec3 middle_m = (low_m + high_m) / 2.0, reach_m = 0.3 * (high_m - low_m);
  const auto keyframes = static_cast<int>(state.max_iterations);
  KeyframeTimes times;
  // Calls timed(keyframe), which calls keyframe() once for each keyframe.
  const auto walk = [&](const auto& timed) {
    PageLoader loader(page_fetch(*file, field, ceilings), PageBudget{4'000'000'000});
    OctreePool pool(field, ceilings, file->trees(), file->signal_maps(), loader);
    VisibilityCache cache(surfaces, field.speed_of_sound_mps(),
                          {.rays_per_keyframe = static_cast<int>(state.range(0))});
    const auto sampler = make_priority_sampler(field, weights, pool, 2000, &cache);
    double way_m = 0, time_s = 10;
    const auto step = [&] {
      way_m += 0.03;
      time_s += 0.02;
      return Vec3(middle_m.x + reach_m.x * std::sin(way_m / reach_m.x), low_m.y + 1.7,
                  middle_m.z + 0.3 * reach_m.z * std::cos(way_m / reach_m.x));
    };
    const auto go_there = [&](int count) {
      for (int i = 0; i < count; ++i) {
        const Vec3 place = step();
        sampler->sample(place, time_s);
        while (!sampler->complete()) sampler->sample(place, time_s);
      }
    };
    go_there(100 + keyframes);
    way_m = 0;
    go_there(100);
    times.begin_walk();
    timed([&] {
      const Vec3 place = step();
      times.time(cache, [&] { sampler->sample(place, time_s); });
    });
  };
  for (int w = 1; w < kWalks; ++w)
    walk([&](const auto& keyframe) {
      for (int k = 0; k < keyframes; ++k) keyframe();
    });
  walk([&](const auto& keyframe) {
    for (auto _ : state) keyframe();
  });
  times.report(state);
  state.counters["least_ms"] = times.median_of_least_ms();
  state.counters["sources"] = static_cast<double>(file->top()->sources_below);
}
BENCHMARK(sight_of_bake)
    ->ArgNames({"rays"})
    ->Arg(kRaysPerKeyframe)
    ->Iterations(500)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
