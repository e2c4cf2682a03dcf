#include "tools/analysis/sampled_response.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "formats/bake_file/expanded_sources.h"
#include "tests/rooms.h"
#include "tests/runtime/two_rooms.h"

namespace clamor {
namespace {

using testing::World;

double response_db(double power) { return 10 * std::log10(power + 1e-30); }

TEST(SampledResponse, WithPriorityEqualsTheOccludedPowerOfAllSources) {
  const World world(testing::two_rooms(true), 200);
  const Vec3 beside_the_door(6, 3.6, 1.5);
  const auto energy = [&](const StrategyOptions& options) {
    std::array<double, kBandCount> sum{};
    for (const Arrival& arrival :
         sampled_response(options, world.sources, world.contents.emitters, world.contents.materials,
                          world.contents.settings.air, beside_the_door, 0, {}, &world.surfaces))
      for (std::size_t b = 0; b < kBandCount; ++b) sum[b] += static_cast<double>(arrival.energy[b]);
    return sum;
  };
  const auto all = energy({.strategy = "all"});
  const auto as_many = energy({.strategy = "priority", .voices = world.sources.size()});
  const auto fewer = energy({.strategy = "priority", .voices = world.sources.size() / 8});
  for (std::size_t b = 0; b < kBandCount; ++b) {
    EXPECT_GT(all[b], 0);
    // A source that a coarse test calls occluded and a fine one does not is missing.
    EXPECT_NEAR(response_db(as_many[b]) - response_db(all[b]), 0, 0.1) << "band " << b;
    EXPECT_NEAR(response_db(fewer[b]) - response_db(all[b]), 0, 1) << "band " << b;
  }
}

// Images of up to three reflections in a box, among 20 000 other sources: all are chosen, and none
// is made louder than it is.
TEST(SampledResponse, WithPriorityHasEachImageExactlyWithTwoThousandVoices) {
  const Level level = testing::shoebox(
      {7, 5, 3}, testing::uniform_material(0.1f, 0.05f, kMirrorExponent), {2.1, 1.3, 1.2});
  const Vec3 listener_m(5.2, 3.7, 1.7);
  for (const std::uint64_t seed : {1, 2}) {
    const auto baked =
        bake(level, {.settings = {.seed = seed, .photons = 5000, .sources = 20'000}});
    ASSERT_TRUE(baked.ok()) << baked.error().message;
    const auto images = image_sources(baked->images, baked->emitters);
    const OcclusionGeometry surfaces(baked->mesh, baked->materials, images);
    ASSERT_EQ(images.size(), 62u);
    std::vector<Source> sources = baked->octree.sources;
    sources.insert(sources.end(), images.begin(), images.end());
    const auto sampled =
        sampled_response({.strategy = "priority", .voices = 2000}, sources, baked->emitters,
                         baked->materials, level.air, listener_m, 0, {}, &surfaces);
    EXPECT_LT(sampled.size(), 2100u);
    for (const Arrival& one : energy_response(images, baked->emitters, baked->materials, level.air,
                                              listener_m, 0, &surfaces)) {
      EXPECT_TRUE(std::ranges::any_of(sampled,
                                      [&](const Arrival& other) {
                                        return std::abs(other.time_s - one.time_s) < 1e-9 &&
                                               other.polarity == 1 &&
                                               std::abs(other.energy[4] / one.energy[4] - 1) <
                                                   1e-3f;
                                      }))
          << one.time_s << " s";
    }
  }
}

}  // namespace
}  // namespace clamor
