// band_mix_test.cpp: upper bounds that know which bands a source has and which of them are loud at
// the moment.
#include "runtime/propagation/band_mix.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "bake/octree/octree_builder.h"
#include "runtime/propagation/source_weight.h"
#include "runtime/query/octree_pool.h"
#include "tests/runtime/random_fractions.h"
#include "tests/runtime/syllables.h"
#include "tests/stored_tree.h"

namespace clamor {
namespace {

float shown(const BandShares& shares, std::size_t band) {
  return shares.share * static_cast<float>(shares.parts[band]) / BandShares::kWhole;
}

TEST(BandMix, IsATightUpperBoundOfItsParts) {
  for (std::uint32_t seed = 0; seed < 1000; ++seed) {
    const Bands parts = testing::random_fractions(seed);
    const BandMix mix = BandMix::from_packed(BandMix::at_least(parts).packed());
    for (std::size_t b = 0; b < kBandCount; ++b) {
      EXPECT_GE(mix.part(b), parts[b]);
      EXPECT_LE(std::sqrt(mix.part(b)), std::sqrt(parts[b]) + 1.001f / 15);
    }
  }
  for (std::size_t b = 0; b < kBandCount; ++b) {
    EXPECT_EQ(BandMix::at_least({}).part(b), 0);
    EXPECT_EQ(BandMix::at_least(same_in_all_bands(1)).part(b), 1);
    EXPECT_EQ(BandMix::at_least(same_in_all_bands(std::nanf(""))).part(b), 1);
  }
}

TEST(BandMix, OfSharesNeverExceedsTheLargestShare) {
  for (std::uint32_t seed = 0; seed < 1000; ++seed) {
    const Bands parts = testing::random_fractions(seed),
                shares = testing::random_fractions(seed + 5000);
    float sum = 0;
    for (std::size_t b = 0; b < kBandCount; ++b) sum += parts[b] * shares[b];
    const float most = *std::max_element(shares.begin(), shares.end());
    const float of = BandMix::at_least(parts).of(shares);
    EXPECT_GE(of, std::min(sum, most) * (1 - 1e-6f));
    EXPECT_LE(of, most);
  }
}

TEST(BandShares, AreUpperBounds) {
  for (std::uint32_t seed = 0; seed < 1000; ++seed) {
    const Bands shares = testing::random_fractions(seed);
    const BandShares bytes = BandShares::at_least(shares);
    EXPECT_EQ(bytes.share, *std::max_element(shares.begin(), shares.end()));
    for (std::size_t b = 0; b < kBandCount; ++b) {
      EXPECT_GE(shown(bytes, b), shares[b] * (1 - 1e-6f));
      EXPECT_LE(shown(bytes, b), shares[b] + bytes.share * 1.001f / 255);
    }
  }
  EXPECT_EQ(BandShares::at_least({}).share, 0);
}

}  // namespace
}  // namespace clamor
