// part_reflection_test.cpp: the image of a source in a movable part, against the same surfaces
// built in, whose images have exact solutions (tests/physics/plate_test.cpp).
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/occlusion/image_path.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "tests/box_mesh.h"

namespace clamor {
namespace {

constexpr Vec3 kSource_m(2, 0.2, -0.1);

// Absorbs and scatters more in higher bands.
Material mirror() {
  Material material = mirror_material();
  for (std::size_t b = 0; b < kBandCount; ++b) {
    material.absorption[b] = 0.05f * static_cast<float>(b);
    material.scattering[b] = 0.03f * static_cast<float>(b);
  }
  return material;
}

// A rectangle across x = 0.
Mesh rectangle(double low_y, double high_y, double low_z, double high_z) {
  Mesh mesh;
  testing::add_quad(mesh, {Vec3f(0, low_y, low_z), Vec3f(0, high_y, low_z),
                           Vec3f(0, high_y, high_z), Vec3f(0, low_y, high_z)});
  return mesh;
}

// Surfaces of the level, and a part.
struct Surfaces {
  Surfaces(const Mesh& level, const Mesh& part, const PartPose& pose = {})
      : materials{mirror()}, geometry(level, materials) {
    if (part.triangles.empty()) return;
    (void)parts.add(*PartShape::make(part, materials), pose);
    scene.update(parts);
    geometry.set_parts(&scene);
  }
  // The share of the power of the image in x = 0 that arrives.
  Bands reflected(bool in_part, const Vec3& listener_m) const {
    Source image;
    image.is_emitter = image.is_image = true;
    image.position_m = {-kSource_m.x, kSource_m.y, kSource_m.z};
    image.original_m = Vec3f(kSource_m);
    image.is_in_part = in_part;
    std::uint64_t rays = 0;
    return image_sound(geometry, image, {image.position_m, Vec3f(listener_m), 343.2}, rays)
        .visibility;
  }

  std::vector<Material> materials;
  OcclusionGeometry geometry;
  MovingParts parts;
  PartScene scene;
};

// On the mirror's direction and off it, before the plate and beside it.
const std::vector<Vec3> kListeners_m = {{2, 0.3, 0.4}, {1, 0.8, -0.5},  {2, 1.9, 0.2},
                                        {3, 0.1, 2.6}, {0.5, 1.2, 1.2}, {1.5, -2.5, 0.1}};

void expect_near(const Bands& is, const Bands& expected, const Vec3& at_m,
                 double relative = 0.002) {
  for (std::size_t b = 0; b < kBandCount; ++b)
    EXPECT_NEAR(is[b], expected[b], 1e-3 + relative * static_cast<double>(expected[b]))
        << "band " << b << " at " << at_m.x << " " << at_m.y << " " << at_m.z;
}

TEST(PartReflection, IsThatOfTheSamePlateBuiltIn) {
  const Mesh plate = rectangle(-1, 1, -1, 1);
  const Surfaces built_in(plate, {}), part({}, plate);
  for (const Vec3& listener_m : kListeners_m)
    expect_near(part.reflected(true, listener_m), built_in.reflected(false, listener_m),
                listener_m);
  // Long waves pass the plate by, and short ones lose what the material takes.
  const Bands share = part.reflected(true, kListeners_m[0]);
  EXPECT_LT(share[0], 0.5);
  EXPECT_NEAR(share[7], (1 - 0.35) * (1 - 0.21), 0.05);
}

TEST(PartReflection, IsThatOfABoxBuiltIn) {
  Mesh box = box_mesh({0.02, 1, 0.5}, 0);
  for (Vec3f& vertex : box.vertices_m) vertex.x -= 0.02f;
  const Surfaces built_in(box, {}), part({}, box);
  for (const Vec3& listener_m : kListeners_m)
    expect_near(part.reflected(true, listener_m), built_in.reflected(false, listener_m),
                listener_m);
}

// A part that is turned and scaled into the place of the plate.
TEST(PartReflection, FollowsThePose) {
  Mesh lying;  // of 1 x 1 m, across y
  testing::add_quad(lying, {Vec3f(-0.5f, 0, -0.5f), Vec3f(0.5f, 0, -0.5f), Vec3f(0.5f, 0, 0.5f),
                            Vec3f(-0.5f, 0, 0.5f)});
  const auto half = static_cast<float>(std::sqrt(0.5));
  const Surfaces built_in(rectangle(-1, 1, -1, 1), {}),
      part({}, lying, {{}, Rotation(half, 0, 0, half), 2});
  for (const Vec3& listener_m : std::span(kListeners_m).first(5))
    expect_near(part.reflected(true, listener_m), built_in.reflected(false, listener_m), listener_m,
                0.05);
}

TEST(PartReflection, EndsBehindThePartAndWhereTheLevelHidesIt) {
  const Mesh plate = rectangle(-1, 1, -1, 1);
  const Surfaces alone({}, plate);
  EXPECT_EQ(alone.reflected(true, {-1, 0, 0})[7], 0);
  Mesh wall;
  testing::add_wall_across(wall, 1, {0, 9, 9}, 0);
  for (Vec3f& vertex : wall.vertices_m) vertex -= Vec3f(0, 4.5f, 4.5f);
  const Surfaces hidden(wall, plate);
  EXPECT_GT(alone.reflected(true, {2, 0.3, 0.4})[7], 0.4);
  EXPECT_LT(hidden.reflected(true, {2, 0.3, 0.4})[7], 0.01);
}

// A wall with a doorway and the door that fills it reflect as the whole wall, each where it is.
TEST(PartReflection, OfADoorAddsUpWithItsWall) {
  Mesh wall = rectangle(-8, 8, -8, -0.5);
  for (const Mesh& piece :
       {rectangle(-8, 8, 0.5, 8), rectangle(-8, -1, -0.5, 0.5), rectangle(1, 8, -0.5, 0.5)}) {
    const auto first = static_cast<std::uint32_t>(wall.vertices_m.size());
    wall.vertices_m.insert(wall.vertices_m.end(), piece.vertices_m.begin(), piece.vertices_m.end());
    for (auto triangle : piece.triangles) {
      for (std::uint32_t& corner : triangle) corner += first;
      wall.triangles.push_back(triangle);
      wall.materials.push_back(0);
    }
  }
  const Surfaces closed(wall, rectangle(-1, 1, -0.5, 0.5));
  const Surfaces whole(rectangle(-8, 8, -8, 8), {});
  const Vec3 off_the_door(2, 0.3, 0.1), off_the_wall(2, 0.3, 5);
  const Bands expected = whole.reflected(false, off_the_door);
  EXPECT_NEAR(closed.reflected(true, off_the_door)[7], expected[7], 0.05 * expected[7]);
  EXPECT_LT(closed.reflected(false, off_the_door)[7], 0.05 * expected[7]);
  EXPECT_NEAR(closed.reflected(false, off_the_wall)[7], expected[7], 0.05 * expected[7]);
  EXPECT_LT(closed.reflected(true, off_the_wall)[7], 0.05 * expected[7]);
}

TEST(PartShapes, KnowTheirLargeFacesWithTheSideThatIsOutside) {
  const std::vector<Material> materials = {mirror_material()};
  const auto box = *PartShape::make(box_mesh({0.5, 1, 0.02}, 0), materials);
  ASSERT_EQ(box->faces().size(), 2u) << "the narrow sides have less than 0.1 m2";
  for (const PartShape::Face& face : box->faces()) {
    EXPECT_TRUE(face.is_outside);
    EXPECT_NEAR(face.area_m2, 2, 1e-6);
    EXPECT_NEAR(face.offset_m, 0.02, 1e-6);
    EXPECT_NEAR(face.radius_m, std::sqrt(1.25), 1e-6);
    EXPECT_NEAR(face.reflected, 0.9, 1e-6);
    EXPECT_NEAR(dot(face.normal, face.centre_m), 0.02, 1e-6);
  }
  const auto sheet = *PartShape::make(rectangle(-1, 1, -1, 1), materials);
  ASSERT_EQ(sheet->faces().size(), 1u);
  EXPECT_FALSE(sheet->faces()[0].is_outside);
  const std::vector<Material> scattering = {testing::uniform_material(0.1f)};
  EXPECT_TRUE((*PartShape::make(rectangle(-1, 1, -1, 1), scattering))->faces().empty());
}

}  // namespace
}  // namespace clamor
