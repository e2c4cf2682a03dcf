// moving_parts_test.cpp: rays and visibilities with parts that move, against levels in which the
// same triangles are built in.
#include "runtime/occlusion/moving_parts.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/occlusion_batch.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "tests/runtime/door_leaf.h"
#include "tests/runtime/two_rooms.h"

namespace clamor {
namespace {

using testing::door;
using testing::door_leaf;
using testing::door_pose;
using testing::kSpeed_mps;
using testing::two_rooms;

// A level's surfaces with movable parts.
struct Movable {
  Movable(const Mesh& mesh, const std::vector<Material>& of, const std::vector<MovablePart>& added)
      : materials(of), surfaces(mesh, of) {
    surfaces.set_parts(&scene);
    for (const MovablePart& part : added)
      handles.push_back(*parts.add(*PartShape::make(part.mesh, materials), part.rest_pose));
    commit();
  }
  std::span<const PartBounds> commit() { return scene.update(parts); }

  const std::vector<Material> materials;
  MovingParts parts;
  PartScene scene;
  OcclusionGeometry surfaces;
  std::vector<PartHandle> handles;
};

// Lines from the first room to the second.
LineOfSight line(std::uint32_t i) {
  const RandomBits a = philox(5, {i, 0, 0, 0}), b = philox(5, {i, 1, 0, 0});
  return {Vec3f(0.2 + 4.6 * unit(a[0]), 0.2 + 3.6 * unit(a[1]), 0.2 + 2.6 * unit(a[2])),
          Vec3f(5.3 + 4.6 * unit(b[0]), 0.2 + 3.6 * unit(b[1]), 0.2 + 2.6 * unit(b[2])),
          kSpeed_mps};
}

Bands visibility(const OcclusionGeometry& surfaces, const LineOfSight& at) {
  std::uint64_t rays = 0;
  return fresnel_visibility(surfaces, at, kFinePaths, rays);
}

double db(float power) { return 10 * std::log10(std::max(static_cast<double>(power), 1e-3)); }

constexpr std::uint32_t kLines = 400;

// Expects the same visibilities as with the parts built in. Returns how many bands were between
// silent and free.
int expect_as_built_in(const Movable& is, const Mesh& mesh, const char* what) {
  const OcclusionGeometry expected(mesh, is.materials);
  int partial = 0;
  for (std::uint32_t i = 0; i < kLines; ++i) {
    const Bands a = visibility(is.surfaces, line(i)), b = visibility(expected, line(i));
    EXPECT_EQ(is.surfaces.is_free(line(i).from_m, line(i).to_m),
              expected.is_free(line(i).from_m, line(i).to_m));
    for (std::size_t band = 0; band < kBandCount; ++band) {
      // An instance's rays are rounded in its own coordinates: a path that grazes an edge may fall
      // on its other side, which is one of the 64 of a ring.
      EXPECT_NEAR(db(a[band]), db(b[band]), 0.5) << what << ", line " << i << ", band " << band;
      partial += b[band] > 0 && b[band] < 1;
    }
  }
  return partial;
}

TEST(MovingParts, OccludeAsTheSameDoorThatIsBuiltIn) {
  const Level level = two_rooms(true);
  for (const double open_deg : {0.0, 20.0, 45.0, 90.0, -60.0}) {
    const Movable is(level.mesh, level.materials, {door(open_deg)});
    const Mesh built_in = testing::with_built_in(level.mesh, {door(open_deg)});
    const int partial = expect_as_built_in(is, built_in, std::to_string(open_deg).c_str());
    EXPECT_GE(partial, open_deg == 0 ? 0 : 500);
  }
}

TEST(MovingParts, OccludeWhereTheyHaveMovedAndAsLargeAsTheyAreScaled) {
  const Level level = two_rooms(true);
  Movable is(level.mesh, level.materials, {door(0)});
  PartPose pose = door_pose(30);
  pose.scale = 0.7;
  pose.position_m += Vec3(0.1, 0.2, 0.3);
  ASSERT_TRUE(is.parts.move(is.handles[0], pose).ok());
  EXPECT_EQ(is.commit().size(), 2u);
  const Mesh built_in = testing::with_built_in(level.mesh, {{"Door", door_leaf(), pose}});
  EXPECT_GT(expect_as_built_in(is, built_in, "scaled"), 500);
}

TEST(MovingParts, ThatAreRemovedOrDisabledLeaveNothingBehind) {
  const Level level = two_rooms(true);
  const OcclusionGeometry without(level.mesh, level.materials);
  Movable is(level.mesh, level.materials, {door(0), door(45)});
  ASSERT_TRUE(is.parts.remove(is.handles[0]).ok());
  ASSERT_TRUE(is.parts.enable(is.handles[1], false).ok());
  EXPECT_EQ(is.commit().size(), 2u);
  const auto as_without = [&] {
    for (std::uint32_t i = 0; i < kLines; ++i)
      EXPECT_EQ(visibility(is.surfaces, line(i)), visibility(without, line(i))) << i;
  };
  as_without();
  ASSERT_TRUE(is.parts.enable(is.handles[1], true).ok());
  EXPECT_EQ(is.commit().size(), 1u);
  EXPECT_GT(expect_as_built_in(is, testing::with_built_in(level.mesh, {door(45)}), "again"), 500);
  ASSERT_TRUE(is.parts.remove(is.handles[1]).ok());
  is.commit();
  as_without();
}

TEST(MovingParts, TransmitPerBandAsABuiltInDoor) {
  Level level = two_rooms(true);
  Material wood = testing::uniform_material(0.6f);
  wood.transmission = {0.5f, 0.4f, 0.3f, 0.2f, 0.1f, 0.05f, 0, 0};
  level.materials.push_back(wood);
  const Movable is(level.mesh, level.materials, {door(0, 1), door(40, 1)});
  const OcclusionGeometry expected(testing::with_built_in(level.mesh, {door(0, 1), door(40, 1)}),
                                   level.materials);
  int through = 0;
  for (std::uint32_t i = 0; i < kLines; ++i) {
    std::uint64_t rays = 0;
    const Bands a = is.surfaces.transmission(line(i).from_m, line(i).to_m, rays);
    const Bands b = expected.transmission(line(i).from_m, line(i).to_m, rays);
    const Bands of_parts = is.surfaces.transmission_of_parts(line(i).from_m, line(i).to_m, rays);
    for (std::size_t band = 0; band < kBandCount; ++band) {
      EXPECT_NEAR(a[band], b[band], 1e-6) << i;
      // The walls transmit nothing.
      EXPECT_NEAR(of_parts[band], b[band], 1e-6) << i;
    }
    through += b[0] > 0;
  }
  EXPECT_GT(through, 10);
}

TEST(MovingParts, InPacketsOccludeAsOneByOne) {
  const Level level = two_rooms(true);
  const Movable is(level.mesh, level.materials, {door(35)});
  std::vector<LineOfSight> lines;
  for (std::uint32_t i = 0; i < kLines; ++i) lines.push_back(line(i));
  const auto together = estimate_visibilities(is.surfaces, lines, kMediumPaths);
  for (std::uint32_t i = 0; i < kLines; ++i) {
    std::uint64_t rays = 0;
    const Bands one = fresnel_visibility(is.surfaces, lines[i], kMediumPaths, rays);
    for (std::size_t band = 0; band < kBandCount; ++band)
      EXPECT_NEAR(together[i].diffracted[band], one[band], 0.1) << i;
  }
}

TEST(MovingParts, OccludeInAFreeField) {
  const Movable is(Mesh{}, std::vector<Material>(1), {door(0)});
  EXPECT_FALSE(is.surfaces.empty());
  EXPECT_FALSE(is.surfaces.is_free({4, 2, 1}, {6, 2, 1}));
  EXPECT_TRUE(is.surfaces.is_free({4, 2, 2.5}, {6, 2, 2.5}));
  const Movable none(Mesh{}, std::vector<Material>(1), {});
  EXPECT_TRUE(none.surfaces.empty());
}

TEST(MovingParts, RefuseWhatIsNoPoseAndNoMesh) {
  MovingParts parts;
  const std::vector<Material> materials(1);
  const auto shape = *PartShape::make(door_leaf(), materials);
  const PartHandle door = *parts.add(shape, {});
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr auto kNanF = std::numeric_limits<float>::quiet_NaN();
  const PartPose wrong[] = {{{kNan, 0, 0}},         {{0, 1e30, 0}},
                            {{0, 0, -HUGE_VAL}},    {{}, {0, 0, 0, 0}},
                            {{}, {kNanF, 0, 0, 1}}, {{}, {1e30f, 0, 0, 0}},
                            {{}, {1, 0, 0, 0}, 0},  {{}, {1, 0, 0, 0}, kNan},
                            {{}, {1, 0, 0, 0}, -1}, {{}, {1, 0, 0, 0}, 1e9}};
  for (const PartPose& pose : wrong) {
    EXPECT_FALSE(parts.move(door, pose).ok());
    EXPECT_FALSE(parts.add(shape, pose).ok());
  }
  EXPECT_EQ(parts.size(), 1u);
  EXPECT_TRUE(parts.remove(door).ok());
  EXPECT_FALSE(parts.remove(door).ok());
  EXPECT_FALSE(parts.move(door, {}).ok());
  EXPECT_FALSE(parts.enable({7, 1}, true).ok());

  Mesh mesh = door_leaf();
  EXPECT_FALSE(PartShape::make(Mesh{}, materials).ok());
  EXPECT_FALSE(PartShape::make(mesh, {}).ok());
  mesh.vertices_m[3].y = kNanF;
  EXPECT_FALSE(PartShape::make(mesh, materials).ok());
  mesh = door_leaf();
  mesh.triangles[5][1] = 8;
  EXPECT_FALSE(PartShape::make(mesh, materials).ok());
}

// Whatever is far away, tiny or degenerate occludes nothing and breaks nothing.
TEST(MovingParts, AtTheLimitsStayFinite) {
  Mesh flat = door_leaf();
  for (Vec3f& vertex : flat.vertices_m) vertex = Vec3f(0.3f);
  const Level level = two_rooms(true);
  PartPose far_off{{1e6, -1e6, 1e6}, {1, 0, 0, 0}, 1e-3};
  const Movable is(level.mesh, level.materials,
                   {{"far", door_leaf(), far_off}, {"flat", flat, {}}});
  const OcclusionGeometry without(level.mesh, level.materials);
  for (std::uint32_t i = 0; i < 50; ++i)
    EXPECT_EQ(visibility(is.surfaces, line(i)), visibility(without, line(i)));
}

TEST(MovingParts, AreTakenOverHoweverOftenTheyHaveMoved) {
  MovingParts parts;
  PartScene scene;
  const std::vector<Material> materials(1);
  const auto shape = *PartShape::make(door_leaf(), materials);
  std::vector<PartHandle> doors;
  for (int i = 0; i < 5; ++i) doors.push_back(*parts.add(shape, {}));
  for (int step = 1; step <= 60; ++step) {
    const double x_m = step;
    ASSERT_TRUE(parts.move(doors[static_cast<std::size_t>(step % 5)], {{x_m, 0, 0}}).ok());
    EXPECT_FALSE(scene.is_up_to_date(parts));
    if (step % 7 != 0) continue;
    // Each door appears once, then leaves a place and comes to another.
    EXPECT_EQ(scene.update(parts).size(), step == 7 ? 5u : 10u);
    EXPECT_TRUE(scene.is_up_to_date(parts));
    EXPECT_TRUE(scene.update(parts).empty());
    for (int back = 0; back < 5; ++back)
      EXPECT_EQ(parts.parts()[static_cast<std::size_t>((step - back) % 5)].pose.position_m.x,
                step - back);
  }
}

}  // namespace
}  // namespace clamor
