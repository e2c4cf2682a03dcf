// query_ablation_benchmark.cpp: how much CPU time each part of the query saves, by turning it off.
//
// A listener walks at 1.5 m/s and then stands still in the stadium, in Sponza (both levels lie
// beside the repository) and in a city of instances (tests/city.h), with 10^5, 10^6 and 10^7
// sources that play 16 signals of speech-like loudness; 2000 are chosen per keyframe. One row per
// part that is off, ready for runtime/README.md: median and 99th percentile of the sampler's thread
// time per keyframe without rays, walking and standing, the mean time of rays, and the mean number
// of chosen sources. All variants share one page loader and take turns of 25 keyframes, so that
// other load on the machine slows all of them alike.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include "bake/octree/octree_builder.h"
#include "common/cpu_time.h"
#include "common/random.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/bake_file/signal_envelope.h"
#include "formats/gltf/level_import.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/sampler.h"
#include "tests/build_paths.h"
#include "tests/city.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

constexpr std::uint32_t kSignals = 16;
constexpr std::size_t kVoices = 2000;
constexpr int kSlices = 12, kSlice_keyframes = 25, kUntimed = 3;

TimedEnvelope speech_of(std::uint32_t seed) {
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

std::vector<Source> sources_on(const Mesh& mesh, std::uint32_t count) {
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
    source.normal = Vec3f(normal);
    const Vec3 way(unit(b[2]) - 0.5, unit(b[3]) - 0.5, unit(a[3]) - 0.5);
    source.mirror = Vec3f(normalize(1.5 * normal + way));
    source.emitter = i % kSignals;
    source.material = mesh.materials[t];
    source.delay_s = static_cast<float>(0.02 + 1.5 * unit(b[0]));
    source.power = same_in_all_bands(static_cast<float>(std::pow(10, -6 * unit(b[0]))));
    source.patch_radius_m = 0.3f;
    source.u = static_cast<float>(unit_above_zero(b[1]));
  }
  return sources;
}

// Level of the walk; everything in it outlives the runs.
struct QueryScene {
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  Air air;
  testing::StoredTrees trees;
  std::unique_ptr<BakeFile> file;
  std::unique_ptr<RadiationModel> radiation;
  SignalWeights weights, ceilings;
  std::unique_ptr<OcclusionGeometry> surfaces;
  std::unique_ptr<PageLoader> loader;
  std::span<const PageEntry> tops;
  std::span<const std::vector<std::uint32_t>> maps;
  Vec3 low_m{}, high_m{};
  double city_m = 0;

  Vec3 at(double path_length_m) const {
    if (file != nullptr) return Vec3(city_m + path_length_m, 2, city_m);
    const Vec3 middle_m = (low_m + high_m) / 2.0, reach_m = 0.3 * (high_m - low_m);
    return Vec3(middle_m.x + reach_m.x * std::sin(path_length_m / reach_m.x), low_m.y + 1.7,
                middle_m.z + 0.3 * reach_m.z * std::cos(path_length_m / reach_m.x));
  }
};

std::unique_ptr<QueryScene> mesh_scene(const char* name, std::uint32_t count) {
  auto scene = std::make_unique<QueryScene>();
  const std::string path = testing::shared_level(name + std::string(".glb"));
  const auto level = import_level(path, {});
  if (!level.ok()) return nullptr;
  const Mesh& mesh = level->level.mesh;
  scene->trees.add(build_octree(sources_on(mesh, count)));
  scene->materials = level->level.materials;
  scene->emitters.resize(kSignals);
  for (std::uint32_t e = 0; e < kSignals; ++e) scene->emitters[e].signal = e;
  scene->radiation =
      std::make_unique<RadiationModel>(scene->emitters, scene->materials, scene->air);
  std::vector<TimedEnvelope> envelopes;
  for (std::uint32_t s = 0; s < kSignals; ++s) envelopes.push_back(speech_of(s));
  scene->weights = make_signal_weights(envelopes);
  scene->ceilings = scene->weights;
  scene->surfaces = std::make_unique<OcclusionGeometry>(mesh, level->level.materials);
  scene->loader = std::make_unique<PageLoader>(
      scene->trees.fetch(*scene->radiation, scene->weights), PageBudget{8'000'000'000});
  scene->tops = scene->trees.tops();
  scene->low_m = Vec3(scene->tops.back().low_m);
  scene->high_m = Vec3(scene->tops.back().high_m);
  return scene;
}

std::unique_ptr<QueryScene> city_scene(std::uint32_t count) {
  auto scene = std::make_unique<QueryScene>();
  testing::CitySize size;
  size.stadiums = 1;
  size.stands = std::max(1u, count / 100'000);
  scene->city_m = std::max(50.0, 70 * std::ceil(std::sqrt(size.stands)));
  const std::string path = (std::filesystem::temp_directory_path() /
                            ("clamor_ablation_" + std::to_string(::getpid()) + ".clamor"))
                               .string();
  if (!write_bake(path, testing::city(size, 1), 1).ok()) return nullptr;
  auto file = BakeFile::open(path);
  if (!file.ok()) return nullptr;
  scene->file = std::make_unique<BakeFile>(std::move(*file));
  std::filesystem::remove(path);
  scene->radiation = std::make_unique<RadiationModel>(scene->file->emitters(),
                                                      scene->file->materials(), scene->air);
  std::vector<TimedEnvelope> envelopes;
  for (std::uint32_t s = 0; s < 3; ++s) envelopes.push_back(speech_of(s));
  scene->weights = make_signal_weights(envelopes);
  scene->ceilings = max_over_instances(scene->weights, scene->file->signal_maps());
  scene->loader = std::make_unique<PageLoader>(
      page_fetch(*scene->file, *scene->radiation, scene->ceilings), PageBudget{8'000'000'000});
  scene->tops = scene->file->trees();
  scene->maps = scene->file->signal_maps();
  return scene;
}

// All pages, so that runs can share them: none comes or goes.
void load_all(PageLoader& loader, const PageEntry& entry) {
  if (!loader.load_now(entry)) return;
  for (const PageEntry& child : loader.find(entry)->links.children) load_all(loader, child);
}

struct Variant {
  const char* name;
  QuerySwitches query;
};

const std::vector<Variant>& variants() {
  static const std::vector<Variant> all = {
      {"all parts", {}},
      {"without node front", {.front = false}},
      {"without shortlists", {.shortlists = false}},
      {"without representatives", {.representatives = false}},
      {"without occlusion bounds", {.occlusion = false}},
      {"without late boost", {.late_boost = false}},
  };
  return all;
}

struct Times {
  std::vector<double> query_ms;
  double rays_ms = 0;
  double at(double share) {
    std::sort(query_ms.begin(), query_ms.end());
    return query_ms.empty()
               ? 0
               : query_ms[std::min<std::size_t>(query_ms.size() - 1,
                                                static_cast<std::size_t>(share * query_ms.size()))];
  }
};

struct Run {
  Run(QueryScene& at, const Variant& what)
      : scene(at), pool(*at.radiation, at.ceilings, at.tops, at.maps, *at.loader) {
    pool.ablate(what.query);
    if (at.surfaces != nullptr)
      cache = std::make_unique<VisibilityCache>(*at.surfaces, at.radiation->speed_of_sound_mps(),
                                                VisibilityOptions{});
    sampler = make_priority_sampler(*at.radiation, at.weights, pool, kVoices, cache.get(),
                                    SearchBound::kBounded);
  }
  void keyframe(double step_m, Times* times) {
    path_length_m += step_m;
    time_s += 0.02;
    const Listener listener = motion.next(scene.at(path_length_m));
    const double cast_ms = cache ? cache->statistics().ray_ms : 0;
    const double start_s = thread_time_s();
    const std::size_t chosen = sampler->sample(listener, time_s).size();
    const double took_ms = 1e3 * (thread_time_s() - start_s);
    const double casting_ms = cache ? cache->statistics().ray_ms - cast_ms : 0;
    voices += chosen;
    ++frames;
    if (times == nullptr) return;
    times->query_ms.push_back(took_ms - casting_ms);
    times->rays_ms += casting_ms;
  }
  void warm_up() {
    for (int i = 0; i < 100 + kSlices * kSlice_keyframes; ++i) {
      path_length_m += 0.03;
      time_s += 0.02;
      const Listener listener = motion.next(scene.at(path_length_m));
      sampler->sample(listener, time_s);
      while (!sampler->complete()) sampler->sample(listener, time_s);
    }
    path_length_m = 0;
    for (int i = 0; i < 100; ++i) keyframe(0.03, nullptr);
    voices = frames = 0;
  }

  QueryScene& scene;
  OctreePool pool;
  std::unique_ptr<VisibilityCache> cache;
  std::unique_ptr<Sampler> sampler;
  ListenerMotion motion{0.02};
  double path_length_m = 0, time_s = 10;
  std::size_t voices = 0, frames = 0;
  Times walking, standing;
};

void query_ablation(benchmark::State& state) {
  const auto count = static_cast<std::uint32_t>(state.range(1));
  const std::unique_ptr<QueryScene> scene =
      state.range(0) == 2 ? city_scene(count)
                          : mesh_scene(state.range(0) == 0 ? "stadium" : "sponza", count);
  if (scene == nullptr) return state.SkipWithError("the level is not here");
  for (auto _ : state) {
    for (const PageEntry& top : scene->tops) load_all(*scene->loader, top);
    std::vector<std::unique_ptr<Run>> runs;
    for (const Variant& variant : variants()) {
      runs.push_back(std::make_unique<Run>(*scene, variant));
      runs.back()->warm_up();
    }
    for (int slice = 0; slice < kSlices; ++slice)
      for (const auto& run : runs)
        for (int i = 0; i < kSlice_keyframes; ++i)
          run->keyframe(0.03, i < kUntimed ? nullptr : &run->walking);
    for (int slice = 0; slice < kSlices / 2; ++slice)
      for (const auto& run : runs)
        for (int i = 0; i < kSlice_keyframes; ++i)
          run->keyframe(0, slice == 0 || i < kUntimed ? nullptr : &run->standing);
    static const char* const kNames[] = {"stadium", "Sponza", "city"};
    for (std::size_t v = 0; v < runs.size(); ++v) {
      Run& run = *runs[v];
      std::printf("| %s | %u | %-28s | %.2f | %.2f | %.2f | %.2f | %.2f | %zu |\n",
                  kNames[state.range(0)], count, variants()[v].name, run.walking.at(0.5),
                  run.walking.at(0.99), run.standing.at(0.5), run.standing.at(0.99),
                  run.walking.rays_ms / static_cast<double>(run.walking.query_ms.size()),
                  run.voices / run.frames);
    }
    std::fflush(stdout);
  }
}
BENCHMARK(query_ablation)
    ->ArgNames({"scene", "sources"})
    ->ArgsProduct({{2, 0, 1}, {100'000, 1'000'000, 10'000'000}})
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

}  // namespace
}  // namespace clamor
