#include "tools/analysis/sampled_response.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace clamor
