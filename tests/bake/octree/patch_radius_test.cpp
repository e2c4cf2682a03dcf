#include "bake/octree/patch_radius.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace clamor {
namespace {

// A wall with sources of equal power every `step` metres.
std::vector<Source> wall(int side, float step) {
  std::vector<Source> sources;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y) {
      Source source;
      source.position_m = {static_cast<float>(x) * step, static_cast<float>(y) * step, 0};
      source.power = same_in_all_bands(1);
      sources.push_back(source);
    }
  return sources;
}

TEST(PatchRadius, OnAUniformWallIsADiscOfTheAreaPerSource) {
  auto sources = wall(41, 0.1f);
  set_patch_radii(sources);
  const Source& middle = sources[20 * 41 + 20];
  // Sixteen neighbours reach 2 to sqrt(5) steps; a disc of their number has an area of 16 square
  // steps, up to the graininess of the grid.
  const double expected_m = 0.1 / std::sqrt(2 * std::numbers::pi);
  EXPECT_NEAR(middle.patch_radius_m / expected_m, 1, 0.15);
}

TEST(PatchRadius, GrowsWithTheSourcesShareOfTheLocalPower) {
  auto sources = wall(41, 0.1f);
  sources[20 * 41 + 20].power = same_in_all_bands(5);
  set_patch_radii(sources);
  auto even = wall(41, 0.1f);
  set_patch_radii(even);
  // R^2 = d^2 5 / 20 instead of d^2 / 16.
  EXPECT_NEAR(sources[20 * 41 + 20].patch_radius_m / even[20 * 41 + 20].patch_radius_m, 2, 1e-5);
}

TEST(PatchRadius, IsFiniteForOneSourceAndForNone) {
  std::vector<Source> none;
  set_patch_radii(none);
  auto one = wall(1, 1);
  set_patch_radii(one);
  EXPECT_TRUE(std::isfinite(one[0].patch_radius_m));
  std::vector<Source> same(100, one[0]);
  set_patch_radii(same);
  EXPECT_EQ(same[50].patch_radius_m, 0);
}

}  // namespace
}  // namespace clamor
