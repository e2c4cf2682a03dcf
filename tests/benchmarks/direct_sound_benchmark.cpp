// direct_sound_benchmark.cpp: cost of a direct sound, and of an image source, with all edges near
// its path, as a multiple of a fine estimate of the direct sound's Fresnel zone in the same run.
//
// Lines between random places at the height of people, at most 20 m long, as between an emitter and
// a listener; only those are counted that an edge partly or wholly occludes. `ratio` is of CPU
// time, `rays` and `fine_rays` are per line. An image is that in the surface that is straight below
// the source; all materials count as mirrors.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/cpu_time.h"
#include "common/random.h"
#include "formats/gltf/level_import.h"
#include "runtime/occlusion/direct_sound.h"
#include "runtime/occlusion/image_path.h"
#include "tests/build_paths.h"

namespace clamor {
namespace {

std::vector<LineOfSight> occluded_lines(const OcclusionGeometry& geometry, const Mesh& mesh) {
  Vec3f low_m = mesh.vertices_m.front(), high_m = low_m;
  for (const Vec3f& vertex_m : mesh.vertices_m) {
    low_m = glm::min(low_m, vertex_m);
    high_m = glm::max(high_m, vertex_m);
  }
  const auto place_m = [&](const RandomBits& bits) {
    const auto at = [&](std::size_t i) { return 0.1f + 0.8f * static_cast<float>(unit(bits[i])); };
    return Vec3f(low_m.x + at(0) * (high_m.x - low_m.x), low_m.y + 1 + at(1),
                 low_m.z + at(2) * (high_m.z - low_m.z));
  };
  std::vector<LineOfSight> lines;
  std::uint64_t rays = 0;
  for (std::uint32_t i = 0; lines.size() < 200 && i < 10'000; ++i) {
    const LineOfSight line{place_m(philox(3, {i, 0, 0, 0})), place_m(philox(3, {i, 1, 0, 0})),
                           343.2};
    if (glm::length(line.to_m - line.from_m) > 20) continue;
    if (fresnel_visibility(geometry, line, kMediumPaths, rays) != same_in_all_bands(1))
      lines.push_back(line);
  }
  return lines;
}

// Times `estimate`, which takes a line and adds its rays.
template <class Estimate>
void over_edges(benchmark::State& state, const std::string& level, const Estimate& estimate) {
  if (!std::filesystem::exists(level)) {
    state.SkipWithError("needs the levels beside the repository");
    return;
  }
  auto imported = import_level(level, ImportOptions{});
  for (Material& material : imported->level.materials) {
    material.scattering = same_in_all_bands(0);
    material.phong = same_in_all_bands(kMirrorExponent);
  }
  const OcclusionGeometry geometry(imported->level.mesh, imported->level.materials);
  const std::vector<LineOfSight> lines = occluded_lines(geometry, imported->level.mesh);
  double edges_s = 0, fine_s = 0;
  std::uint64_t rays = 0, fine_rays = 0;
  for (auto _ : state)
    for (const LineOfSight& line : lines) {
      const double start_s = thread_time_s();
      estimate(geometry, line, rays);
      const double middle_s = thread_time_s();
      benchmark::DoNotOptimize(fresnel_visibility(geometry, line, kFinePaths, fine_rays));
      edges_s += middle_s - start_s;
      fine_s += thread_time_s() - middle_s;
    }
  const auto runs = static_cast<double>(state.iterations()) * static_cast<double>(lines.size());
  state.counters["ratio"] = edges_s / fine_s;
  state.counters["us"] = 1e6 * edges_s / runs;
  state.counters["rays"] = static_cast<double>(rays) / runs;
  state.counters["fine_rays"] = static_cast<double>(fine_rays) / runs;
}

void direct_sound_over_edges(benchmark::State& state, const std::string& level) {
  over_edges(state, level,
             [](const OcclusionGeometry& geometry, const LineOfSight& line, std::uint64_t& rays) {
               bool line_is_free = true;
               const Bands zone =
                   fresnel_visibility(geometry, line, kMediumPaths, rays, &line_is_free);
               benchmark::DoNotOptimize(direct_sound(geometry, line, zone, line_is_free, rays));
             });
}
BENCHMARK_CAPTURE(direct_sound_over_edges, violin_room,
                  std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(direct_sound_over_edges, sponza, testing::shared_level("sponza.glb"))
    ->Unit(benchmark::kMillisecond);

void image_sound_over_edges(benchmark::State& state, const std::string& level) {
  over_edges(state, level,
             [](const OcclusionGeometry& geometry, const LineOfSight& line, std::uint64_t& rays) {
               constexpr float kDown_m = 100;
               const auto floor =
                   geometry.first_level_hit(line.from_m, line.from_m - Vec3f(0, kDown_m, 0));
               if (!floor) return;
               Source image;
               image.is_emitter = image.is_image = true;
               image.original_m = line.from_m;
               image.position_m = line.from_m - Vec3f(0, 2 * floor->fraction * kDown_m, 0);
               const LineOfSight from_image{image.position_m, line.to_m, line.speed_of_sound_mps};
               benchmark::DoNotOptimize(image_sound(geometry, image, from_image, rays));
             });
}
BENCHMARK_CAPTURE(image_sound_over_edges, violin_room,
                  std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(image_sound_over_edges, sponza, testing::shared_level("sponza.glb"))
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
