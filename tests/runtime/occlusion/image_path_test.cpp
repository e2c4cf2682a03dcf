// Image sources: the paths to a listener that their visibility stands for.
#include "runtime/occlusion/image_path.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/part_shape.h"
#include "runtime/occlusion/visibility_cache.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

constexpr Vec3 kSourcePlace_m(0, 2, 0);

// A panel of 4 x 4 m in the plane y = 0, and the image in it of a source above.
struct Panel {
  Mesh mesh;
  std::vector<Material> materials = {testing::uniform_material(0.2f, 0.5f, kMirrorExponent)};
  Source image;

  Panel() {
    testing::add_quad(mesh, {Vec3f(-2, 0, -2), Vec3f(2, 0, -2), Vec3f(2, 0, 2), Vec3f(-2, 0, 2)});
    image.is_emitter = image.is_image = true;
    image.position_m = {0, -2, 0};
    image.mirror = Vec3f(kSourcePlace_m);
  }
};

float seen(const OcclusionGeometry& geometry, const Source& image, const Vec3& place) {
  std::uint64_t rays = 0;
  const Bands share = image_visibility(geometry, image, place, rays);
  EXPECT_EQ(share, same_in_all_bands(share[0]));
  EXPECT_LE(rays, 76u);
  return share[0];
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

TEST(ImagePath, IsHiddenByWhatIsOnEitherLegAndOnlyByThat) {
  Panel panel;
  const Vec3 ear_m(3, 2, 0);  // the mirror point is at x = 1.5
  const auto hidden = [&](double x_m, double from_y_m, double to_y_m) {
    Panel with = panel;
    const auto x = static_cast<float>(x_m);
    testing::add_quad(with.mesh, {Vec3f(x, from_y_m, -1), Vec3f(x, to_y_m, -1), Vec3f(x, to_y_m, 1),
                                  Vec3f(x, from_y_m, 1)});
    with.materials[0].scattering = same_in_all_bands(0);
    const OcclusionGeometry geometry(with.mesh, with.materials);
    return seen(geometry, with.image, ear_m) == 0;
  };
  EXPECT_TRUE(hidden(0.75, 0.5, 1.5)) << "before the mirror";
  EXPECT_TRUE(hidden(2.25, 0.5, 1.5)) << "behind it";
  EXPECT_FALSE(hidden(0.75, 1.8, 2.2)) << "beside the path";
  EXPECT_FALSE(hidden(1.5, 1.5, 2.5)) << "in the direct sound";
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
    parts.commit();
    if (parts.has_news()) cache.change_parts(scene.update(parts.latest()));
    cache.begin_keyframe({3, 2, 0});
    return cache.estimate_now(7, panel.image)[0];
  };
  EXPECT_NEAR(heard(), 0.4, 1e-6);
  ASSERT_TRUE(parts.move(*door, {.position_m = {2.25, 1, 0}}).ok());
  EXPECT_EQ(heard(), 0);
  ASSERT_TRUE(parts.move(*door, {.position_m = {20, 0, 0}}).ok());
  EXPECT_NEAR(heard(), 0.4, 1e-6);
}

}  // namespace
}  // namespace clamor
