// moving_parts_benchmark.cpp: what doors cost that move: the commit of their scene, marking what is
// stale in a visibility cache, rays beside them, and their reflections; and how near these come to
// a bake that has the part built in.
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include <benchmark/benchmark.h>

#include "bake/bake.h"
#include "common/random.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/bake_file/geometry_section.h"
#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/probes/part_images.h"
#include "runtime/response/energy_response.h"
#include "runtime/sampling/sampler.h"
#include "tests/benchmarks/keyframe_times.h"
#include "tests/rooms.h"
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
  std::span<const PartBounds> update() { return scene.update(parts); }

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
    cache.change_parts(scene.update(parts));
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

// Finds the images of 64 emitters in so many doors, as each keyframe does while anything moves.
void part_images_found(benchmark::State& state) {
  const std::vector<Material> materials = {mirror_material()};
  std::vector<Emitter> emitters(64);
  for (std::size_t e = 0; e < emitters.size(); ++e)
    emitters[e].position_m = {0.31 * static_cast<double>(e), 1.5, 0.17 * static_cast<double>(e)};
  const RadiationModel radiation(emitters, materials, {});
  const SignalWeights weights{{same_in_all_bands(1)}};
  MovingParts parts;
  PartScene scene;
  const auto shape = *PartShape::make(box_mesh({0.5, 1, 0.02}, 0), materials);
  for (int d = 0; d < state.range(0); ++d)
    (void)parts.add(shape, {{2.0 * (d % 10), 1, 2.0 * (d / 10)}});
  scene.update(parts);
  PartImages images(scene, emitters, radiation, weights, nullptr);
  std::vector<FoundSource> found;
  double time_s = 0;
  for (auto _ : state) {
    images.begin({Vec3(7, 1.7, 5), time_s += 0.02});
    found.clear();
    images.find_above(0, found.max_size(), found);
  }
  state.counters["images"] = static_cast<double>(found.size());
}
BENCHMARK(part_images_found)
    ->ArgNames({"doors"})
    ->Arg(0)
    ->Arg(1)
    ->Arg(10)
    ->Arg(100)
    ->Unit(benchmark::kMicrosecond);

// A street of 40 x 40 m that absorbs and scatters a tenth, and a lorry of 8 x 3 x 2.5 m that
// reflects nine tenths, 2.75 m from the source.
struct Street {
  explicit Street(bool has_lorry) {
    Level level;
    level.name = "street";
    testing::add_quad(level.mesh,
                      {Vec3f(-20, 0, -20), Vec3f(-20, 0, 20), Vec3f(20, 0, 20), Vec3f(20, 0, -20)});
    level.materials = {testing::uniform_material(0.1f, 0.1f, kMirrorExponent), mirror_material()};
    level.signals = {testing::sine()};
    level.emitters.emplace_back().position_m = {4, 1.2, 1};
    if (has_lorry) append(placed(lorry(), kPose), level.mesh);
    BakeOptions options;
    options.settings.photons = 20'000;
    contents = *bake(level, options);
    sources = contents.octree.sources;
    const auto images = image_sources(contents.images, contents.emitters);
    sources.insert(sources.end(), images.begin(), images.end());
  }
  static Mesh lorry() { return box_mesh({1.25, 1.5, 4}, 1); }
  static constexpr PartPose kPose{{0, 1.8, 0}};

  BakeContents contents;
  std::vector<Source> sources;
};

// Energy that arrives, by band.
std::array<double, kBandCount> energy(const Street& street, std::span<const Source> sources,
                                      const OcclusionGeometry& surfaces, const Vec3& place_m) {
  std::array<double, kBandCount> sum{};
  for (const Arrival& arrival :
       energy_response(sources, street.contents.emitters, street.contents.materials,
                       street.contents.settings.air, place_m, std::nullopt, &surfaces))
    for (std::size_t b = 0; b < kBandCount; ++b) sum[b] += static_cast<double>(arrival.energy[b]);
  return sum;
}

// Prints the differences, over 6 places on the source's side and the bands from 125 Hz to 4 kHz,
// between the lorry as a part and as built in: of the level, in decibels. Energies are added, as
// room acoustics does, so the interference of direct sound and reflection does not count.
void part_reflection_error(benchmark::State& state) {
  const bool reflects = state.range(0) != 0;
  double sum_db = 0, sum_db2 = 0;
  int count = 0;
  for (auto _ : state) {
    const Street built_in(true), open(false);
    const OcclusionGeometry with_lorry(built_in.contents.mesh, built_in.contents.materials);
    OcclusionGeometry surfaces(open.contents.mesh, open.contents.materials);
    MovingParts parts;
    (void)parts.add(*PartShape::make(Street::lorry(), open.contents.materials), Street::kPose);
    PartScene scene;
    scene.update(parts);
    surfaces.set_parts(&scene);
    const RadiationModel radiation(open.contents.emitters, open.contents.materials, {});
    const SignalWeights weights{{same_in_all_bands(1)}};
    PartImages images(scene, open.contents.emitters, radiation, weights, nullptr);
    for (const Vec3& place_m : {Vec3(6, 1.5, -2), Vec3(3, 1.6, -3), Vec3(9, 1.7, 0),
                                Vec3(2, 1.2, 3), Vec3(5, 1.5, 6), Vec3(12, 1.6, -6)}) {
      std::vector<Source> sources = open.sources;
      std::vector<FoundSource> found;
      images.begin({place_m});
      images.find_above(0, found.max_size(), found);
      for (const FoundSource& one : found)
        if (reflects) sources.push_back(*one.source);
      const auto is = energy(open, sources, surfaces, place_m),
                 expected = energy(built_in, built_in.sources, with_lorry, place_m);
      for (std::size_t b = 1; b < 7; ++b) {
        const double error_db = 10 * std::log10(is[b] / expected[b]);
        sum_db += error_db;
        sum_db2 += error_db * error_db;
        ++count;
      }
    }
  }
  state.counters["mean_dB"] = sum_db / count;
  state.counters["rms_dB"] = std::sqrt(sum_db2 / count);
}
BENCHMARK(part_reflection_error)
    ->ArgNames({"reflects"})
    ->Arg(0)
    ->Arg(1)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clamor
