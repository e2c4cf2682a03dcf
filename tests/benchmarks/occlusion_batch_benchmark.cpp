// occlusion_batch_benchmark.cpp: speedup of batched visibility tests over single ones, which
// decides how long exact impulse responses take.
//
// Lines lead from all over the walls of Sponza (66 000 triangles; it comes with the levels beside
// the repository) to one listener, with eight paths per ring. `ratio` is by one thread's CPU time
// in the same run; `differ` counts lines with different results: paths through the edge between two
// surfaces.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/cpu_time.h"
#include "common/random.h"
#include "formats/gltf/level_import.h"
#include "runtime/occlusion/occlusion_batch.h"
#include "tests/build_paths.h"

namespace clamor {
namespace {

// Evenly distributed over all surfaces, like reflections.
std::vector<LineOfSight> lines_from(const Mesh& mesh, const Vec3f& to_m) {
  constexpr std::uint32_t kLines = 60'000;
  std::vector<double> area_m2;
  double sum_m2 = 0;
  const auto across = [&mesh](std::size_t t) {
    const auto corner = [&](std::size_t c) { return Vec3(mesh.vertices_m[mesh.triangles[t][c]]); };
    return cross(corner(1) - corner(0), corner(2) - corner(0));
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    area_m2.push_back(sum_m2 += length(across(t)) / 2);
  std::vector<LineOfSight> lines;
  for (std::uint32_t i = 0; i < kLines; ++i) {
    const RandomBits bits = philox(4, {i, 0, 0, 0});
    const auto found = std::upper_bound(area_m2.begin(), area_m2.end(), unit(bits[0]) * sum_m2);
    const auto t = static_cast<std::size_t>(found - area_m2.begin());
    if (t >= area_m2.size()) continue;
    const auto& corners = mesh.triangles[t];
    const double u = std::sqrt(unit(bits[1])), v = unit(bits[2]);
    const Vec3 at_m = (1 - u) * Vec3(mesh.vertices_m[corners[0]]) +
                      u * (1 - v) * Vec3(mesh.vertices_m[corners[1]]) +
                      u * v * Vec3(mesh.vertices_m[corners[2]]);
    lines.push_back({Vec3f(at_m + 0.005 * normalize(across(t))), to_m, 343.2});
  }
  return lines;
}

void looks(benchmark::State& state) {
  if (!std::filesystem::exists(testing::shared_level("sponza.glb"))) {
    state.SkipWithError("needs ../shared/levels/sponza.glb");
    return;
  }
  const auto imported = import_level(testing::shared_level("sponza.glb"), ImportOptions{});
  const OcclusionGeometry geometry(imported->level.mesh, imported->level.materials);
  const std::vector<LineOfSight> lines = lines_from(imported->level.mesh, {0, 2, 0});
  double one_s = 0, many_s = 0;
  std::uint64_t differ = 0, rays = 0;
  for (auto _ : state) {
    const double start_s = thread_time_s();
    std::vector<Bands> one;
    for (const LineOfSight& line : lines)
      one.push_back(fresnel_visibility(geometry, line, kMediumPaths, rays));
    const double middle_s = thread_time_s();
    const auto many = estimate_visibilities(geometry, lines, kMediumPaths, 1);
    many_s += thread_time_s() - middle_s;
    one_s += middle_s - start_s;
    differ = 0;
    for (std::size_t i = 0; i < lines.size(); ++i) differ += many[i].diffracted != one[i];
  }
  const auto runs = static_cast<double>(state.iterations());
  state.counters["ratio"] = one_s / many_s;
  state.counters["differ"] = static_cast<double>(differ);
  state.counters["us_a_look"] = 1e6 * many_s / runs / static_cast<double>(lines.size());
}
BENCHMARK(looks)->Unit(benchmark::kMillisecond)->Name("looks/side by side/one thread");

}  // namespace
}  // namespace clamor
