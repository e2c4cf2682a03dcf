// visibility_parts_test.cpp: a sampler beside doors that open and close, against visibilities that
// are computed anew for each state of the doors.
#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "runtime/occlusion/visibility_cache.h"
#include "tests/runtime/door_leaf.h"
#include "tests/runtime/two_rooms.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

using testing::door_leaf;
using testing::door_pose;
using testing::kSpeed_mps;
using testing::two_rooms;
using testing::World;

using Power = std::array<double, kBandCount>;

const Vec3 kPlace(8, 2.1, 1.5);

// Differences below -30 dB do not count.
double db(double power) { return 10 * std::log10(std::max(power, 1e-3)); }

double worst_db(const Bands& is, const Bands& expected) {
  double worst = 0;
  for (std::size_t b = 0; b < kBandCount; ++b)
    worst = std::max(
        worst, std::abs(db(static_cast<double>(is[b])) - db(static_cast<double>(expected[b]))));
  return worst;
}

Bands visibility(const OcclusionGeometry& surfaces, const Source& source, const Vec3& place) {
  std::uint64_t rays = 0;
  return source_visibility(surfaces, kSpeed_mps, source, place, kMediumPaths, rays);
}

// A door between two rooms, and samplers that hear it.
class Doorway {
 public:
  explicit Doorway(std::uint64_t photons) : world_(two_rooms(true), photons) {
    world_.surfaces.set_parts(&scene_);
    door_ = *parts_.add(*PartShape::make(door_leaf(), world_.contents.materials), door_pose(0));
  }

  void open(double angle_deg) { ASSERT_TRUE(parts_.move(door_, door_pose(angle_deg)).ok()); }
  void remove() { ASSERT_TRUE(parts_.remove(door_).ok()); }

  // Where parts have changed, for caches.
  std::span<const PartBounds> update() { return scene_.update(parts_); }

  Bands reference_of_emitter(const Vec3& place) const {
    const auto emitter = std::ranges::find_if(
        world_.sources, [](const Source& source) { return source.is_emitter; });
    return visibility(world_.surfaces, *emitter, place);
  }
  // The power of all sources.
  Power reference(const Vec3& place) const {
    Power power{};
    for (const Source& source : world_.sources) {
      const Bands intensity = world_.radiation.intensity(source, place);
      if (intensity == Bands{}) continue;
      const Bands visible = fine_visibility(world_.surfaces, kSpeed_mps, source, place);
      for (std::size_t b = 0; b < kBandCount; ++b)
        power[b] += static_cast<double>(intensity[b] * visible[b]);
    }
    return power;
  }

  World world_;
  MovingParts parts_;
  PartScene scene_;
  PartHandle door_;
};

// A sampler of all sources.
struct Hearing {
  explicit Hearing(Doorway& doorway, const VisibilityOptions& options = {})
      : world(doorway.world_),
        list(world.radiation, world.weights, world.sources),
        occlusion(world.surfaces, kSpeed_mps, options),
        sampler(make_priority_sampler(world.radiation, world.weights, list, world.sources.size(),
                                      &occlusion)) {}

  // Samples after parts have changed.
  void sample(std::span<const PartBounds> changed, const Vec3& place) {
    occlusion.change_parts(changed);
    const auto chosen = sampler->sample(place);
    power = testing::heard(world, chosen, place);
    of_emitter = {};  // an occluded emitter is not chosen
    for (const SampledSource& one : chosen)
      if (one.source->is_emitter) of_emitter = one.factors.occlusion;
  }
  double worst_error_db(const Power& expected) const {
    double worst = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      worst = std::max(worst, std::abs(10 * std::log10(power[b] / expected[b])));
    return worst;
  }

  const World& world;
  SourceList list;
  VisibilityCache occlusion;
  std::unique_ptr<Sampler> sampler;
  Power power{};
  Bands of_emitter{};
};

TEST(VisibilityParts, OpenAndCloseADoorWithinTheKeyframe_NoAsan) {
  Doorway doorway(testing::kSanitized ? 100 : 200);
  Hearing hearing(doorway);
  for (int i = 0; i < 60; ++i) hearing.sample(doorway.update(), kPlace);
  EXPECT_EQ(hearing.of_emitter, Bands{});
  for (const double angle_deg : {90.0, 0.0, 40.0, 15.0}) {
    doorway.open(angle_deg);
    hearing.sample(doorway.update(), kPlace);
    EXPECT_LT(worst_db(hearing.of_emitter, doorway.reference_of_emitter(kPlace)), 0.01)
        << angle_deg;
    // Thousands of reflections do not get rays at once.
    const Power expected = doorway.reference(kPlace);
    EXPECT_LT(hearing.worst_error_db(expected), 1.5) << angle_deg;
    for (int i = 0; i < 25; ++i) hearing.sample({}, kPlace);
    EXPECT_LT(hearing.worst_error_db(expected), 0.75) << angle_deg;
  }
}

TEST(VisibilityParts, FollowADoorThatOpensInASecondWithoutSteps_NoAsan) {
  Doorway doorway(testing::kSanitized ? 40 : 100);
  Hearing hearing(doorway);
  for (int i = 0; i < 60; ++i) hearing.sample(doorway.update(), kPlace);
  Bands before{}, expected_before{};
  for (int keyframe = 0; keyframe <= 50; ++keyframe) {
    const double angle_deg = 90 * keyframe / 50.0;
    doorway.open(angle_deg);
    hearing.sample(doorway.update(), kPlace);
    const Bands expected = doorway.reference_of_emitter(kPlace);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double step_db =
          db(static_cast<double>(hearing.of_emitter[b])) - db(static_cast<double>(before[b]));
      const double expected_db =
          db(static_cast<double>(expected[b])) - db(static_cast<double>(expected_before[b]));
      EXPECT_NEAR(step_db, expected_db, 0.5) << "band " << b << " at " << angle_deg;
    }
    before = hearing.of_emitter;
    expected_before = expected;
    if (keyframe % 10 != 0) continue;
    EXPECT_LT(hearing.worst_error_db(doorway.reference(kPlace)), 1) << angle_deg;
  }
}

TEST(VisibilityParts, AreEstimatedAnewForEachStateByAnExactSampler) {
  Doorway doorway(60);
  Hearing hearing(doorway, {.exact = true});
  for (const double angle_deg : {0.0, 90.0, 35.0, 0.0}) {
    doorway.open(angle_deg);
    const auto changed = doorway.update();
    for (int i = 0; i < 3; ++i) {
      hearing.sample(i == 0 ? changed : std::span<const PartBounds>(), kPlace);
      Hearing anew(doorway, {.exact = true});
      anew.sample(changed, kPlace);
      EXPECT_EQ(hearing.power, anew.power) << angle_deg;
      EXPECT_EQ(hearing.of_emitter, anew.of_emitter);
    }
  }
}

TEST(VisibilityParts, ThatAreRemovedLeaveTheSampleOfALevelWithoutThem) {
  Doorway doorway(60), without(60);
  without.remove();
  without.update();  // before anything is heard
  Hearing hearing(doorway, {.exact = true}), expected(without, {.exact = true});
  hearing.sample(doorway.update(), kPlace);
  expected.sample({}, kPlace);
  EXPECT_GT(hearing.worst_error_db(expected.power), 0.1);
  doorway.remove();
  hearing.sample(doorway.update(), kPlace);
  EXPECT_EQ(hearing.power, expected.power);
}

TEST(VisibilityParts, AreHeardByListenersOnBothSides) {
  Doorway doorway(60);
  Hearing far(doorway), near(doorway);
  const Vec3 near_place(3, 2, 1.5);
  for (int i = 0; i < 60; ++i) {
    const auto changed = doorway.update();
    far.sample(changed, kPlace);
    near.sample(changed, near_place);
  }
  doorway.open(90);
  const auto changed = doorway.update();
  far.sample(changed, kPlace);
  near.sample(changed, near_place);
  EXPECT_LT(worst_db(far.of_emitter, doorway.reference_of_emitter(kPlace)), 0.01);
  EXPECT_EQ(near.of_emitter, same_in_all_bands(1));
  EXPECT_LT(far.worst_error_db(doorway.reference(kPlace)), 1);
  EXPECT_LT(near.worst_error_db(doorway.reference(near_place)), 1);
}

// A wall with a hundred doorways 1.2 m apart, an emitter behind each door, and the listener in
// front of their middle.
TEST(VisibilityParts, FollowAHundredDoorsThatMoveAtOnce) {
  constexpr int kDoors = 100;
  constexpr double kSpacing_m = 1.2;
  Level level;
  level.materials = {testing::uniform_material(0.3f)};
  std::vector<Source> sources;
  const auto z_m = [](int d) { return kSpacing_m * d; };
  for (int d = 0; d < kDoors; ++d) {
    const auto z0 = static_cast<float>(z_m(d) + 1), z1 = static_cast<float>(z_m(d + 1));
    testing::add_quad(level.mesh, {Vec3f(0, 0, z0), {0, 3, z0}, {0, 3, z1}, {0, 0, z1}});
    Source& source = sources.emplace_back();
    source.position_m = Vec3f(-2, 1.5f, static_cast<float>(z_m(d) + 0.5));
    source.is_emitter = true;
    source.power = same_in_all_bands(1);
    source.u = 1;
    source.emitter = static_cast<std::uint32_t>(d);
  }
  std::vector<Emitter> emitters(kDoors);
  const RadiationModel radiation(emitters, level.materials, Air{});
  SignalWeights weights;
  weights.by_signal = {same_in_all_bands(1)};
  OcclusionGeometry surfaces(level.mesh, level.materials);
  MovingParts parts;
  PartScene scene;
  surfaces.set_parts(&scene);
  Mesh leaf = box_mesh({0.02, 1.5, 0.5}, 0);
  for (Vec3f& vertex : leaf.vertices_m) vertex += Vec3f(0, 1.5f, 0.5f);
  const auto shape = *PartShape::make(leaf, level.materials);
  const auto pose = [&](int d, double angle_deg) {
    return PartPose{{0, 0, z_m(d)},
                    Rotation(glm::angleAxis(angle_deg * 0.0174532925, Vec3(0, 1, 0)))};
  };
  std::vector<PartHandle> doors;
  for (int d = 0; d < kDoors; ++d) doors.push_back(*parts.add(shape, pose(d, 0)));
  SourceList list(radiation, weights, sources);
  VisibilityCache occlusion(surfaces, kSpeed_mps, {});
  const auto sampler = make_priority_sampler(radiation, weights, list, kDoors, &occlusion);
  const Vec3 place(6, 1.5, 60);
  const auto sample = [&] {
    occlusion.change_parts(scene.update(parts));
    return sampler->sample(place);
  };
  for (int i = 0; i < 10; ++i) sample();
  for (const double angle_deg : {-90.0, 0.0, -30.0}) {
    for (int d = 0; d < kDoors; ++d)
      ASSERT_TRUE(parts.move(doors[static_cast<std::size_t>(d)], pose(d, angle_deg)).ok());
    // Seventy sounds get their edges in the same keyframe; the others get their zones first.
    std::vector<Bands> is(kDoors);
    for (const SampledSource& one : sample()) is[one.source->emitter] = one.factors.occlusion;
    int bands = 0, off = 0;
    Power power{}, expected_power{}, free{};
    for (int d = 0; d < kDoors; ++d) {
      const auto i = static_cast<std::size_t>(d);
      const Bands expected = visibility(surfaces, sources[i], place);
      const Bands intensity = radiation.intensity(sources[i], place);
      for (std::size_t b = 0; b < kBandCount; ++b) {
        free[b] += static_cast<double>(intensity[b]);
        power[b] += static_cast<double>(intensity[b] * is[i][b]);
        expected_power[b] += static_cast<double>(intensity[b] * expected[b]);
      }
      for (std::size_t b = 0; b < kBandCount; ++b, ++bands)
        off +=
            std::abs(db(static_cast<double>(is[i][b])) - db(static_cast<double>(expected[b]))) > 1;
    }
    EXPECT_LT(off, 0.35 * bands) << angle_deg;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      // What is left behind closed doors, more than 20 dB below the open field, matters less.
      if (expected_power[b] < 0.01 * free[b]) continue;
      EXPECT_NEAR(10 * std::log10(power[b] / expected_power[b]), 0, 1.5) << b << " " << angle_deg;
    }
    for (int i = 0; i < 10; ++i) sample();
    off = 0;
    for (const SampledSource& one : sample()) {
      const std::size_t i = one.source->emitter;
      const Bands settled = one.factors.occlusion;
      const Bands expected = visibility(surfaces, sources[i], place);
      for (std::size_t b = 0; b < kBandCount; ++b)
        off += std::abs(db(static_cast<double>(settled[b])) -
                        db(static_cast<double>(expected[b]))) > 0.01;
    }
    EXPECT_EQ(off, 0) << angle_deg;
  }
}

}  // namespace
}  // namespace clamor
