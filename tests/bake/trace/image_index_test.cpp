#include "bake/trace/image_index.h"

#include <cmath>

#include <gtest/gtest.h>

#include "common/random.h"

namespace clamor {
namespace {

Vec3 random_place(std::uint32_t number, double extent_m) {
  const RandomBits bits = philox(5, {number, 0, 0, 0});
  return extent_m * (2.0 * Vec3(unit(bits[0]), unit(bits[1]), unit(bits[2])) - Vec3(1));
}

bool is_near_an_image(const ImageIndex& index, std::uint32_t emitter, const Vec3& place_m,
                      double path_m) {
  for (const ImageSource& image : index.images())
    if (image.emitter == emitter && length(image.position_m - place_m) <= image_tolerance_m(path_m))
      return true;
  return false;
}

// A search once looked into all cells of half a metre within a tolerance that grows with the path:
// 300 000 at 4 km.
TEST(ImageIndex, FindsWhatAScanFindsInFewCellsWhateverThePath) {
  for (const double extent_m : {5.0, 100.0, 4000.0, 1e5}) {
    ImageIndex grown;
    for (std::uint32_t i = 0; i < 400; ++i)
      grown.add({i % 2, random_place(i, extent_m)}, extent_m * i / 400);
    const ImageIndex whole(grown.images());
    int found = 0;
    for (std::uint32_t i = 0; i < 2000; ++i) {
      const double path_m = 1e-3 * extent_m * std::pow(10.0, 6.0 * i / 2000);
      const Vec3 near_m =
          random_place(i % 500, extent_m) + 1.2 * random_place(7000 + i, image_tolerance_m(path_m));
      const bool expected = is_near_an_image(grown, 1, near_m, path_m);
      std::size_t visits = 0;
      ASSERT_EQ(whole.contains(1, near_m, path_m, &visits), expected)
          << extent_m << " m, path of " << path_m << " m";
      EXPECT_LE(visits, 27u) << extent_m << " m, path of " << path_m << " m";
      found += expected;
    }
    EXPECT_GT(found, 100);
    EXPECT_LT(found, 1900);
  }
}

TEST(ImageIndex, MergesImagesThatAPathOfThisLengthDoesNotTellApart) {
  ImageIndex index;
  EXPECT_EQ(index.add({0, {10, 0, 0}}, 1), 0u);
  EXPECT_EQ(index.add({0, {10, 0.01, 0}}, 1), 0u);
  EXPECT_EQ(index.add({0, {10, 1, 0}}, 1), 1u);
  EXPECT_EQ(index.add({1, {10, 0, 0}}, 1), 2u);
  EXPECT_EQ(index.add({0, {10, -7.5, 0}}, 4000), 0u);  // 8 m
  EXPECT_EQ(index.add({0, {10, -7.5, 0}}, 1), 3u);
}

}  // namespace
}  // namespace clamor
