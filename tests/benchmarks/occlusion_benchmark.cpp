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
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "bake/octree/octree_builder.h"
#include "common/air.h"
#include "common/cpu_time.h"
#include "common/material.h"
#include "common/random.h"
#include "formats/bake_file/signal_envelope.h"
#include "formats/gltf/level_import.h"
#include "formats/level/emitter.h"
#include "formats/level/mesh.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/benchmarks/keyframe_times.h"
#include "tests/build_paths.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

constexpr std::uint32_t kSignals = 16;

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
      const Vec3 direction(unit(b[2]) - 0.5, unit(b[3]) - 0.5, unit(a[3]) - 0.5);
      source.mirror = Vec3f(normalize(1.5 * normal + direction));
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

using BandPower = std::array<double, kBandCount>;

std::vector<Emitter> one_emitter_per_signal(std::size_t signals) {
  std::vector<Emitter> emitters(signals);
  for (std::uint32_t e = 0; e < emitters.size(); ++e) emitters[e].signal = e;
  return emitters;
}

struct SponzaScene {
  SponzaScene(const Level& level, std::uint32_t sources, bool full)
      : materials(full ? level.materials : std::vector<Material>(1)),
        emitters(one_emitter_per_signal(full ? kSignals : 1)),
        radiation(emitters, materials, Air{}),
        surfaces(level.mesh, level.materials) {
    trees.add(build_octree(surface_sources(level.mesh, sources, full)));
    weights.by_signal = {same_in_all_bands(1)};
    if (!full) return;
    std::vector<TimedEnvelope> envelopes;
    for (std::uint32_t s = 0; s < kSignals; ++s) envelopes.push_back(speech(s));
    weights = make_signal_weights(envelopes);
  }

  BandPower received(std::span<const SampledSource> sample, const Vec3& place) const {
    BandPower power{};
    for (const SampledSource& one : sample) {
      const Bands intensity = radiation.intensity(*one.source, place);
      for (std::size_t b = 0; b < kBandCount; ++b)
        power[b] += one.power_scale * static_cast<double>(intensity[b] * one.factors.occlusion[b]);
    }
    return power;
  }

  const std::vector<Material> materials;
  const std::vector<Emitter> emitters;
  const RadiationModel radiation;
  const OcclusionGeometry surfaces;
  testing::StoredTrees trees;
  SignalWeights weights;
};

// A listener who walks through Sponza, with or without occlusion.
class SponzaListener {
 public:
  SponzaListener(const SponzaScene& scene, VisibilityCache* cache)
      : scene_(scene),
        loader_(scene.trees.fetch(scene.radiation, scene.weights), PageBudget{4'000'000'000}),
        pool_(scene.radiation, scene.weights, scene.trees.tops(), {}, loader_),
        sampler_(make_priority_sampler(scene.radiation, scene.weights, pool_, 2000, cache)) {}

  // Samples until all pages of the next `keyframes` places are loaded.
  void load(int keyframes) {
    for (int i = 0; i < keyframes; ++i) {
      next();
      while (!sampler_->complete()) sampler_->sample(place(), time_s_);
    }
  }

  std::span<const SampledSource> next() {
    path_m_ += 0.03;
    time_s_ += 0.02;
    return sampler_->sample(motion_.next(place()), time_s_);
  }

  // Error per band in dB against a sample in which every source is tested from here.
  double error_db() {
    const BandPower now = scene_.received(sampler_->sample(place(), time_s_), place());
    VisibilityCache all(scene_.surfaces, scene_.radiation.speed_of_sound_mps(), {.exact = true});
    SponzaListener exact(scene_, &all);
    exact.path_m_ = path_m_ - 0.03;
    exact.time_s_ = time_s_ - 0.02;
    exact.load(1);
    const BandPower right = scene_.received(exact.sampler_->sample(place(), time_s_), place());
    double worst_db = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      worst_db = std::max(worst_db, std::abs(10 * std::log10(now[b] / right[b])));
    return worst_db;
  }

 private:
  Vec3 place() const { return {9 * std::sin(path_m_ / 9), 1.7, 0.8 * std::cos(path_m_ / 5)}; }

  const SponzaScene& scene_;
  PageLoader loader_;
  OctreePool pool_;
  std::unique_ptr<Sampler> sampler_;
  ListenerMotion motion_{0.02};
  double path_m_ = 0, time_s_ = 10;  // all signals have started
};

double time_without_occlusion_ms(const SponzaScene& scene) {
  SponzaListener listener(scene, nullptr);
  listener.load(100);
  const double start_s = process_time_s();
  for (int i = 0; i < 200; ++i) listener.next();
  return 1e3 * (process_time_s() - start_s) / 200;
}

void occlusion(benchmark::State& state) {
  if (!std::filesystem::exists(testing::shared_level("sponza.glb")))
    return state.SkipWithError("Sponza is not here");
  const auto level = import_level(testing::shared_level("sponza.glb"), {});
  if (!level.ok()) return state.SkipWithError(level.error().message.c_str());
  const SponzaScene scene(level->level, static_cast<std::uint32_t>(state.range(0)),
                          state.range(2) != 0);
  VisibilityCache cache(scene.surfaces, scene.radiation.speed_of_sound_mps(),
                        {.rays_per_keyframe = static_cast<int>(state.range(1))});
  SponzaListener listener(scene, &cache);
  listener.load(100);
  double worst_db = 0, mean_db = 0;
  double voices = 0, wanted = 0, current = 0, frames = 0;
  testing::KeyframeTimes times;
  const VisibilityStatistics before = cache.statistics();
  for (auto _ : state) {
    times.time(cache, [&] { voices += static_cast<double>(listener.next().size()); });
    wanted += static_cast<double>(cache.statistics().wanted);
    current += static_cast<double>(cache.statistics().current);
    ++frames;
    if (std::fmod(frames, 50) != 0) continue;
    state.PauseTiming();
    const double db = listener.error_db();
    worst_db = std::max(worst_db, db);
    mean_db += db / 10;
    state.ResumeTiming();
  }
  const VisibilityStatistics& after = cache.statistics();
  state.counters["voices"] = voices / frames;
  state.counters["rays"] = static_cast<double>(after.rays - before.rays) / frames;
  state.counters["estimates"] = static_cast<double>(after.estimates - before.estimates) / frames;
  state.counters["line_tests"] = static_cast<double>(after.line_tests - before.line_tests) / frames;
  state.counters["late"] = static_cast<double>(after.late - before.late) / frames;
  state.counters["wanted"] = wanted / frames;
  state.counters["current"] = current / wanted;
  state.counters["worst_db"] = worst_db;
  state.counters["mean_db"] = mean_db;
  times.report(state);
  state.counters["free_ms"] = time_without_occlusion_ms(scene);
}
BENCHMARK(occlusion)
    ->ArgNames({"sources", "rays", "full"})
    ->ArgsProduct({{100'000, 1'000'000, 10'000'000}, {kRaysPerKeyframe}, {0, 1}})
    ->ArgsProduct({{1'000'000}, {2000, 4000, 2 * kRaysPerKeyframe, 4 * kRaysPerKeyframe}, {0}})
    ->Iterations(500)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
