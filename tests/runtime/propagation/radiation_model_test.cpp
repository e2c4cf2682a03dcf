// radiation_model_test.cpp: upper bounds of the radiation of sources, and the bands they consist
// of.
#include "runtime/propagation/radiation_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "common/air.h"
#include "runtime/propagation/source_weight.h"
#include "tests/runtime/random_fractions.h"
#include "tests/runtime/scattered_sources.h"
#include "tests/runtime/source_bound_reference.h"
#include "tests/runtime/varied_sources.h"

namespace clamor {
namespace {

// Loose bounds make the query test sources in vain. At an oblique incidence the surface turns most
// of a lobe into diffuse reflection, but less of it near the normal.
TEST(RadiationModel, HasTightUpperBoundsForLobes) {
  testing::ScatteredSources level(9, 4000, 1, {0, 0, 0});
  for (Source& source : level.sources) source.is_emitter = false, source.material = 0;
  level.materials[0].scattering = same_in_all_bands(0.1f);
  for (const auto& [exponent, max_db] : {std::pair{3.0f, 1.1}, {20.0f, 0.75}, {100.0f, 1.0}}) {
    level.materials[0].phong = same_in_all_bands(exponent);
    const RadiationModel radiation(level.emitters, level.materials, Air{});
    const auto sources = level.bounds(radiation);
    double sum_db = 0;
    std::size_t heard = 0;
    for (std::uint32_t s = 0; s < sources.size(); ++s) {
      const Vec3 place = 5.0 * testing::direction(philox(11, {s, 0, 0, 0}));
      const double priority = weight(radiation, level.weight, level.sources[s], place) /
                              std::max(level.sources[s].u, kMinU);
      if (priority <= 0) continue;
      sum_db += 10 * std::log10(testing::priority_upper_bound(sources[s], place) / priority);
      ++heard;
    }
    ASSERT_GT(heard, 1500u);
    EXPECT_LT(sum_db / static_cast<double>(heard), max_db) << exponent;
  }
}

// The bound holds for any set of audible bands in any direction.
TEST(RadiationModel, KnowsTheBandsOfItsUpperBounds) {
  const testing::SourcesOfAllKinds level({1, 2, 3});
  const Bands weight = {1, 2, 3, 4, 5, 4, 3, 2};
  const RadiationModel& radiation = level.radiation();
  for (std::uint32_t s = 0; s < testing::SourcesOfAllKinds::kCount; ++s) {
    Source source = level[s];
    if (source.is_emitter) source.mirror = source.normal;
    const RadiationModel::UpperBound bound = radiation.upper_bound(source, weight);
    const Bands most = radiation.max_intensity(source);
    const double all = bound.diffuse + bound.compensation + static_cast<double>(bound.lobe);
    double sum = 0;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double part = weight[b] * static_cast<double>(most[b]) / all;
      ASSERT_GE(bound.mix.part(b), part * (1 - 1e-5)) << s << " " << b;
      sum += bound.mix.part(b);
    }
    if (!source.is_emitter && source.material <= 1) {
      ASSERT_LT(sum, 1.5) << "one law for all bands leaves rounding errors only";
    }
    for (std::uint32_t i = 0; i < 3; ++i) {
      const Vec3 place =
          Vec3(source.position_m) + 7.0 * Vec3(testing::SourcesOfAllKinds::direction(s, 20 + i));
      const Bands shares = testing::random_fractions(3 * s + i);
      const double now = weighted_sum(weighted(weight, shares), radiation.intensity(source, place));
      const double at_any_time =
          testing::priority_upper_bound(source_bound(radiation, source, bound), place) *
          std::max(source.u, kMinU);
      ASSERT_LE(now, at_any_time * bound.mix.of(shares) * (1 + 1e-5)) << s;
    }
  }
}

// Values of a forged file.
TEST(RadiationModel, TreatsUpperBoundsThatCannotBeDividedAsAnyMixOfBands) {
  const std::vector<Emitter> emitters(1);
  const std::vector<Material> materials(1);
  const RadiationModel radiation(emitters, materials, Air{});
  Source source;
  source.normal = source.mirror = {0, 1, 0};
  for (const float power : {3e38f, 1e-42f, std::numeric_limits<float>::quiet_NaN()}) {
    source.power = same_in_all_bands(power);
    const BandMix mix = radiation.upper_bound(source, same_in_all_bands(1)).mix;
    for (std::size_t b = 0; b < kBandCount; ++b) EXPECT_EQ(mix.part(b), 1) << power;
  }
  source.power = {};
  EXPECT_EQ(radiation.upper_bound(source, same_in_all_bands(1)).mix.packed(), 0u);
}

}  // namespace
}  // namespace clamor
