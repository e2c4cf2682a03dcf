// Image sources: the paths to a listener that their visibility stands for, where no edge is near.
#include "runtime/occlusion/image_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <gtest/gtest.h>

#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "runtime/occlusion/visibility_cache.h"
#include "tests/box_mesh.h"

namespace clamor {
namespace {

constexpr Vec3 kSourcePlace_m(0, 2, 0);

// A panel of 4 x 4 m in the plane y = 0, and the image in it of a source above. It is let into a
// floor that scatters, so that it has no edges.
struct Panel {
  Mesh mesh;
  std::vector<Material> materials = {testing::uniform_material(0.2f, 0.5f, kMirrorExponent),
                                     testing::uniform_material(0.2f)};
  Source image;

  Panel() {
    constexpr std::array<float, 4> kLines = {-40, -2, 2, 40};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        const float x0 = kLines[i], x1 = kLines[i + 1], z0 = kLines[j], z1 = kLines[j + 1];
        testing::add_quad(mesh,
                          {Vec3f(x0, 0, z0), Vec3f(x1, 0, z0), Vec3f(x1, 0, z1), Vec3f(x0, 0, z1)},
                          i == 1 && j == 1 ? 0 : 1);
      }
    image.is_emitter = image.is_image = true;
    image.position_m = {0, -2, 0};
    image.original_m = Vec3f(kSourcePlace_m);
  }
};

Bands seen_in_bands(const OcclusionGeometry& geometry, const Source& image, const Vec3& place,
                    std::uint64_t& rays) {
  return image_sound(geometry, image, {image.position_m, Vec3f(place), 343.2}, rays).visibility;
}

// Where no edge is near, all bands are alike, and few rays suffice.
float seen(const OcclusionGeometry& geometry, const Source& image, const Vec3& place) {
  std::uint64_t rays = 0;
  const Bands share = seen_in_bands(geometry, image, place, rays);
  for (const float one : share) EXPECT_NEAR(one, share[0], 1e-6);
  EXPECT_LE(rays, 76u);
  return share[0];
}

float seen_at_8_khz(const OcclusionGeometry& geometry, const Source& image, const Vec3& place) {
  std::uint64_t rays = 0;
  return seen_in_bands(geometry, image, place, rays).back();
}

TEST(ImagePath, CarriesWhatTheMirrorNeitherAbsorbsNorScatters) {
  const Panel panel;
  const OcclusionGeometry geometry(panel.mesh, panel.materials);
  EXPECT_NEAR(seen(geometry, panel.image, {1, 2, 0.5}), 0.8 * 0.5, 1e-6);
  EXPECT_NEAR(seen(geometry, panel.image, {0, 0.05, 0}), 0.8 * 0.5, 1e-6);  // close to the panel
}

TEST(ImagePath, EndsBehindTheMirrorAndBesideIt) {
  const Panel panel;
  const OcclusionGeometry geometry(panel.mesh, panel.materials);
  EXPECT_EQ(seen(geometry, panel.image, {1, -1, 0.5}), 0);
  EXPECT_EQ(seen(geometry, panel.image, {6, 2, 0}), 0);
  const Panel lobes;
  const OcclusionGeometry others(lobes.mesh,
                                 std::vector{testing::uniform_material(0.2f, 0.5f, 100)});
  EXPECT_EQ(seen(others, lobes.image, {1, 2, 0.5}), 0) << "no mirror";
}

// The mirror point leaves the panel where the listener, at the source's height, is 4 m away.
TEST(ImagePath, FadesAtTheEdgeOfTheMirror) {
  const Panel panel;
  const OcclusionGeometry geometry(panel.mesh, panel.materials);
  const double whole = std::sqrt(0.8 * 0.5);
  double last = whole, at_edge = 0;
  for (double x_m = 3.7; x_m < 4.3; x_m += 0.02) {
    const double amplitude = std::sqrt(seen(geometry, panel.image, {x_m, 2, 0}));
    EXPECT_LE(amplitude, last + 1e-6) << x_m;
    EXPECT_GT(amplitude, last - 0.25 * whole) << x_m;
    if (std::abs(x_m - 4) < 0.01) at_edge = amplitude;
    last = amplitude;
  }
  EXPECT_NEAR(at_edge, 0.5 * whole, 0.1 * whole);
  EXPECT_EQ(last, 0);
}

// Short waves; long ones find their way around (mirror_edges_test.cpp).
TEST(ImagePath, IsHiddenByWhatIsOnEitherLegAndOnlyByThat) {
  Panel panel;
  panel.materials[0].scattering = same_in_all_bands(0);
  const Vec3 ear_m(3, 2, 0);  // the mirror point is at x = 1.5
  const double whole =
      seen_at_8_khz(OcclusionGeometry(panel.mesh, panel.materials), panel.image, ear_m);
  const auto share_past = [&](double x_m, double from_y_m, double to_y_m) {
    Panel with = panel;
    const auto x = static_cast<float>(x_m);
    testing::add_quad(with.mesh, {Vec3f(x, from_y_m, -1), Vec3f(x, to_y_m, -1), Vec3f(x, to_y_m, 1),
                                  Vec3f(x, from_y_m, 1)});
    const OcclusionGeometry geometry(with.mesh, with.materials);
    return seen_at_8_khz(geometry, with.image, ear_m) / whole;
  };
  EXPECT_LT(share_past(0.75, 0.5, 1.5), 0.05) << "before the mirror";
  EXPECT_LT(share_past(2.25, 0.5, 1.5), 0.05) << "behind it";
  EXPECT_NEAR(share_past(0.75, 1.8, 2.2), 1, 0.1) << "beside the path";
  EXPECT_NEAR(share_past(1.5, 1.5, 2.5), 1, 0.1) << "in the direct sound";
}

TEST(ImagePath, IsHiddenByAPartWithinOneKeyframe) {
  const Panel panel;
  OcclusionGeometry geometry(panel.mesh, panel.materials);
  MovingParts parts;
  PartScene scene;
  const auto shape = PartShape::make(box_mesh({0.1, 0.5, 0.5}, 0), panel.materials);
  ASSERT_TRUE(shape.ok());
  const auto door = parts.add(*shape, {.position_m = {20, 0, 0}});
  ASSERT_TRUE(door.ok());
  geometry.set_parts(&scene);
  VisibilityCache cache(geometry, 343.2, {.rays_per_keyframe = 1000});
  const auto heard = [&] {
    cache.change_parts(scene.update(parts));
    cache.begin_keyframe({3, 2, 0});
    return cache.estimate_now(7, panel.image);
  };
  EXPECT_NEAR(heard()[0], 0.4, 1e-6);
  EXPECT_FALSE(cache.bent_path(cache.find(7)));
  ASSERT_TRUE(parts.move(*door, {.position_m = {2.25, 1, 0}}).ok());
  const Bands hidden = heard();
  EXPECT_LT(hidden.back(), 0.05 * 0.4);
  EXPECT_GT(hidden.front(), hidden.back()) << "diffraction";
  EXPECT_TRUE(cache.bent_path(cache.find(7)));
  ASSERT_TRUE(parts.move(*door, {.position_m = {20, 0, 0}}).ok());
  EXPECT_NEAR(heard()[0], 0.4, 1e-6);
  EXPECT_FALSE(cache.bent_path(cache.find(7)));
}

}  // namespace
}  // namespace clamor
