#include "runtime/occlusion/image_mirrors.h"

#include <array>
#include <cstddef>
#include <map>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

namespace clamor {
namespace {

constexpr Vec3 kRoom_m(5, 4, 3), kOriginal_m(1.2, 1.3, 1.1);

std::vector<OccluderPlane> walls_of_box() {
  std::vector<OccluderPlane> walls;
  for (int axis = 0; axis < 3; ++axis)
    for (const double offset_m : {0.0, kRoom_m[axis]}) {
      Vec3f normal(0);
      normal[axis] = 1;
      walls.push_back({normal, static_cast<float>(offset_m)});
    }
  return walls;
}

using Reflections = std::array<int, 3>;  // of an image, across each axis

// Images of a shoebox by their reflections, up to three in all. An image of n reflections across an
// axis is on the side of the wall that reflects last.
std::map<std::tuple<float, float, float>, Reflections> images_of_box() {
  const auto along_m = [](std::size_t axis, int n, bool is_low) {
    const double size_m = kRoom_m[static_cast<int>(axis)];
    double place_m = kOriginal_m[static_cast<int>(axis)];
    for (int i = n; i > 0; --i)
      place_m = ((i % 2 == 1) == is_low) ? -place_m : 2 * size_m - place_m;
    return static_cast<float>(place_m);
  };
  std::map<std::tuple<float, float, float>, Reflections> images;
  for (int x = 0; x <= 3; ++x)
    for (int y = 0; x + y <= 3; ++y)
      for (int z = 0; x + y + z <= 3; ++z)
        for (int sides = 0; sides < 8; ++sides)
          images[{along_m(0, x, (sides & 1) != 0), along_m(1, y, (sides & 2) != 0),
                  along_m(2, z, (sides & 4) != 0)}] = {x, y, z};
  return images;
}

// Walls across one axis reflect alternately, and those across different axes in any order.
TEST(ImageMirrors, AreAllSeriesOfWallsThatLeadToTheImagesOfABox) {
  std::vector<Source> sources;
  const auto images = images_of_box();
  for (const auto& [at_m, reflections] : images) {
    if (reflections == Reflections{}) continue;
    Source& image = sources.emplace_back();
    image.is_emitter = image.is_image = true;
    image.position_m = Vec3f(std::get<0>(at_m), std::get<1>(at_m), std::get<2>(at_m));
    image.original_m = Vec3f(kOriginal_m);
    image.normal = Vec3f(0.6f, 0.48f, 0.64f);
    for (int axis = 0; axis < 3; ++axis)
      if (reflections[static_cast<std::size_t>(axis)] % 2 == 1) image.normal[axis] *= -1;
  }
  ASSERT_EQ(sources.size(), 62u);
  const ImageMirrors mirrors(walls_of_box(), sources);
  constexpr std::array<std::size_t, 4> kFactorial = {1, 1, 2, 6};
  for (const Source& image : sources) {
    const auto found = mirrors.of(image.position_m, image.original_m);
    const Reflections& by = images.at({image.position_m.x, image.position_m.y, image.position_m.z});
    std::size_t order = 0, orders = 1;
    for (const int n : by) {
      order += static_cast<std::size_t>(n);
      orders *= kFactorial[static_cast<std::size_t>(n)];
    }
    EXPECT_EQ(found.size(), kFactorial[order] / orders);
    for (const MirrorSeries& series : found) {
      EXPECT_EQ(series.order, order);
      Vec3 place_m = kOriginal_m;
      for (std::size_t k = 0; k < series.order; ++k) {
        EXPECT_GT(series.planes[k].height_m(place_m), 0);
        place_m = series.planes[k].image_of(place_m);
      }
      EXPECT_LT(length(place_m - Vec3(image.position_m)), 1e-4);
    }
  }
  EXPECT_TRUE(mirrors.of({1, 2, 3}, Vec3f(kOriginal_m)).empty());
}

// The search takes the square of their number, and a file may hold a million.
TEST(ImageMirrors, AreNotSoughtForMoreImagesThanABakeFinds) {
  Source image;
  image.is_emitter = image.is_image = true;
  image.position_m = Vec3f(kOriginal_m) * Vec3f(-1, 1, 1);
  image.original_m = Vec3f(kOriginal_m);
  for (const std::size_t count : {512u, 100'000u}) {
    const ImageMirrors mirrors(walls_of_box(), std::vector<Source>(count, image));
    EXPECT_EQ(mirrors.of(image.position_m, image.original_m).size(), count == 512 ? 1u : 0u);
  }
}

}  // namespace
}  // namespace clamor
