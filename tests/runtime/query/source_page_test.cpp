#include "runtime/query/source_page.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/propagation/source_weight.h"
#include "tests/runtime/scattered_sources.h"

namespace clamor {
namespace {

TEST(SourcePage, FindsTheSameInListsOfAnyLength) {
  for (const std::uint32_t count : {0u, 1u, 511u, 512u, 513u, 5000u}) {
    const testing::ScatteredSources level(7, std::max(count, 1u), 10, {0, 0, 0});
    const RadiationModel radiation(level.emitters, level.materials, Air{});
    const std::vector<Bands> weights(1, level.weight);
    std::vector<Source> sources = level.sources;
    sources.resize(count);
    const SourcePage page(radiation, weights, sources);
    const Vec3 place(2, 1, 0);
    std::vector<bool> found(count, false);
    page.cull(place, 1, [&](std::size_t i, double) { found[i] = true; });
    for (std::uint32_t i = 0; i < count; ++i)
      EXPECT_TRUE(found[i] || weight(radiation, level.weight, sources[i], place) / sources[i].u < 1)
          << i;
  }
}

}  // namespace
}  // namespace clamor
