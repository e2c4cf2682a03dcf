// moving_parts_benchmark.cpp: what doors cost that move: the commit of their scene, marking what is
// stale in a visibility cache, and rays beside them.
#include <cmath>
#include <vector>

#include <benchmark/benchmark.h>

#include "common/random.h"
#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/sampling/sampler.h"
#include "tests/benchmarks/keyframe_times.h"
#include "tests/runtime/door_leaf.h"
#include "tests/runtime/two_rooms.h"

namespace clamor {
namespace {

struct Doors {
  explicit Doors(int count) : materials(1) {
    const auto shape = *PartShape::make(box_mesh({0.5, 1, 0.02}, 0), materials);
    for (int d = 0; d < count; ++d) handles.push_back(*parts.add(shape, pose(d, 0)));
    update();
  }
  static PartPose pose(int d, double angle_rad) {
    return {{2.0 * (d % 10), 1, 2.0 * (d / 10)},
            Rotation(glm::angleAxis(angle_rad, Vec3(0, 1, 0)))};
  }
  void turn(double angle_rad) {
    for (std::size_t d = 0; d < handles.size(); ++d)
      (void)parts.move(handles[d], pose(static_cast<int>(d), angle_rad));
  }
  std::span<const PartBounds> update() {
    parts.commit();
    return scene.update(parts.latest());
  }

  std::vector<Material> materials;
  MovingParts parts;
  PartScene scene;
  std::vector<PartHandle> handles;
};

// Moves and commits all doors, and takes them over.
void moving_parts_commit(benchmark::State& state) {
  Doors doors(static_cast<int>(state.range(0)));
  double angle_rad = 0;
  std::size_t boxes = 0;
  for (auto _ : state) {
    doors.turn(angle_rad += 0.03);
    boxes += doors.update().size();
  }
  state.counters["boxes"] = static_cast<double>(boxes) / static_cast<double>(state.iterations());
}
BENCHMARK(moving_parts_commit)
    ->Arg(1)
    ->Arg(100)
    ->Arg(1000)
    ->Arg(4096)
    ->Unit(benchmark::kMicrosecond);

// Begins a keyframe of a cache of 50 000 reflections in which all doors have moved.
void moving_parts_stale(benchmark::State& state) {
  Doors doors(static_cast<int>(state.range(0)));
  OcclusionGeometry surfaces(Mesh{}, doors.materials);
  surfaces.set_parts(&doors.scene);
  VisibilityCache cache(surfaces, 343.2, {.rays_per_keyframe = 41'000});
  const auto place = [](std::uint32_t i) {
    const RandomBits bits = philox(3, {i, 0, 0, 0});
    return Vec3f(20 * unit(bits[0]), 3 * unit(bits[1]), 20 * unit(bits[2]));
  };
  std::vector<Source> sources(50'000);
  for (std::uint32_t i = 0; i < sources.size(); ++i) {
    sources[i].position_m = place(i);
    if (i % 10'000 == 0) cache.begin_keyframe({10, 1.7, 10});
    cache.test_new(i, sources[i], 1);
  }
  std::vector<VisibilityCache::Wanted> stale;
  std::size_t found = 0;
  double angle_rad = 0;
  for (auto _ : state) {
    state.PauseTiming();
    doors.turn(angle_rad += 0.03);
    cache.change_parts(doors.update());
    state.ResumeTiming();
    cache.begin_keyframe({10, 1.7, 10});
    state.PauseTiming();
    stale.clear();
    for (std::uint32_t i = 0; i < sources.size(); ++i)
      if (cache.is_stale(cache.find(i))) stale.push_back({1, i, cache.find(i), &sources[i]});
    found += stale.size();
    cache.renew(stale);
    state.ResumeTiming();
  }
  state.counters["stale"] = static_cast<double>(found) / static_cast<double>(state.iterations());
}
BENCHMARK(moving_parts_stale)->Arg(1)->Arg(100)->Unit(benchmark::kMicrosecond);

// Keyframes of 2000 voices in two rooms with 100 000 sources, where the door between them is at
// rest or turns by 90 degrees in a second.
void moving_parts_keyframe(benchmark::State& state) {
  testing::World world(testing::two_rooms(true), 5000);
  MovingParts parts;
  PartScene scene;
  world.surfaces.set_parts(&scene);
  const auto shape = *PartShape::make(testing::door_leaf(), world.contents.materials);
  const PartHandle door = *parts.add(shape, testing::door_pose(45));
  SourceList list(world.radiation, world.weights, world.sources);
  VisibilityCache cache(world.surfaces, testing::kSpeed_mps, {});
  const auto sampler = make_priority_sampler(world.radiation, world.weights, list, 2000, &cache);
  const Vec3 place(8, 2.1, 1.5);
  const auto keyframe = [&](double open_deg) {
    (void)parts.move(door, testing::door_pose(open_deg));
    parts.commit();
    if (parts.has_news()) cache.change_parts(scene.update(parts.latest()));
    sampler->sample(place);
  };
  for (int i = 0; i < 100; ++i) keyframe(45);
  testing::KeyframeTimes times;
  const std::uint64_t rays_before = cache.statistics().rays;
  int number = 0;
  for (auto _ : state) {
    ++number;
    const double turned_deg = 1.8 * std::abs(number % 100 - 50);
    times.time(cache, [&] { keyframe(state.range(0) != 0 ? turned_deg : 45); });
  }
  state.counters["sources"] = static_cast<double>(world.sources.size());
  state.counters["rays"] =
      static_cast<double>(cache.statistics().rays - rays_before) / static_cast<double>(number);
  times.report(state);
}
BENCHMARK(moving_parts_keyframe)
    ->ArgNames({"turns"})
    ->Arg(0)
    ->Arg(1)
    ->Iterations(300)
    ->Unit(benchmark::kMillisecond);

void moving_parts_rays(benchmark::State& state) {
  const Doors doors(static_cast<int>(state.range(0)));
  std::uint32_t i = 0, blocked = 0;
  for (auto _ : state) {
    const RandomBits a = philox(3, {++i, 0, 0, 0}), b = philox(3, {i, 1, 0, 0});
    blocked += !doors.scene.is_free(Vec3f(20 * unit(a[0]), 3 * unit(a[1]), 20 * unit(a[2])),
                                    Vec3f(20 * unit(b[0]), 3 * unit(b[1]), 20 * unit(b[2])));
  }
  state.counters["blocked"] = static_cast<double>(blocked) / static_cast<double>(i);
}
BENCHMARK(moving_parts_rays)->Arg(0)->Arg(1)->Arg(100);

}  // namespace
}  // namespace clamor
