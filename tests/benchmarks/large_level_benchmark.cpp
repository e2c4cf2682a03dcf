// large_level_benchmark.cpp: whether the bake of early reflections and photons costs more where
// surfaces are far away.
//
// A room of metres, the same as if it were of millimetres (1000 times as large), a sky dome with a
// radius of 2 km and a closed valley of 4 km: CPU time of all threads for the search of images and
// for 2000 photons, and `of_room`, its ratio to that of the room in metres in the same run.
#include <cmath>
#include <numbers>

#include <benchmark/benchmark.h>

#include "bake/bake.h"
#include "common/cpu_time.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

constexpr std::uint32_t kTurns = 32, kRings = 8;

Vec3f on_dome(double radius_m, double height, std::uint32_t turn) {
  const double angle = 2 * std::numbers::pi * turn / kTurns;
  const double out_m = radius_m * std::sqrt(1 - height * height);
  return Vec3f(Vec3(out_m * std::cos(angle), radius_m * height, out_m * std::sin(angle)));
}

Level room(double scale) {
  return testing::shoebox(scale * Vec3(5, 3, 4), testing::uniform_material(0.1f, 0.1f),
                          scale * Vec3(1.5, 1.2, 1));
}

Level dome() {
  Level level = testing::shoebox({4000, 1, 4000}, testing::uniform_material(0.1f, 0.1f), {3, 2, 1});
  level.mesh = {};
  testing::add_quad(level.mesh, {Vec3f(-2000, 0, -2000), Vec3f(-2000, 0, 2000),
                                 Vec3f(2000, 0, 2000), Vec3f(2000, 0, -2000)});
  for (std::uint32_t ring = 0; ring < kRings; ++ring)
    for (std::uint32_t turn = 0; turn < kTurns; ++turn) {
      const double low = double(ring) / kRings, high = double(ring + 1) / kRings;
      testing::add_quad(level.mesh, {on_dome(2000, low, turn), on_dome(2000, low, turn + 1),
                                     on_dome(2000, high, turn + 1), on_dome(2000, high, turn)});
    }
  return level;
}

// The sides of the valley are uneven, so that there are many images.
Level valley() {
  Level level =
      testing::shoebox({4000, 800, 4000}, testing::uniform_material(0.1f, 0.1f), {2000, 2, 2000});
  for (Vec3f& vertex : level.mesh.vertices_m)
    vertex.x += 0.1f * vertex.y * std::sin(vertex.z + vertex.y);
  return level;
}

double bake_cpu_s(const Level& level) {
  BakeOptions options;
  options.settings.photons = 2000;
  options.settings.sources = 2000;
  const double start_s = process_time_s();
  if (!bake(level, options).ok()) return -1;
  return process_time_s() - start_s;
}

void large_levels(benchmark::State& state) {
  const Level of_metres = room(1);
  const Level levels[] = {of_metres, room(1000), dome(), valley()};
  double ratio = 0;
  for (auto _ : state) {
    const double room_s = bake_cpu_s(of_metres);
    const double level_s = bake_cpu_s(levels[state.range(0)]);
    if (!(room_s > 0 && level_s > 0)) return state.SkipWithError("the bake failed");
    ratio = level_s / room_s;
  }
  state.counters["of_room"] = ratio;
}
BENCHMARK(large_levels)->DenseRange(0, 3)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

}  // namespace
}  // namespace clamor
