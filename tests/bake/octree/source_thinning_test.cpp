#include "bake/octree/source_thinning.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "common/random.h"
#include "tests/peak_memory.h"
#include "tests/sanitized.h"
#include "tests/source_lists.h"

namespace clamor {
namespace {

// Deposits with powers over a range of 60 dB, each at its own position.
std::vector<Source> deposits(std::uint32_t count, std::uint64_t seed) {
  std::vector<Source> sources(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const RandomBits a = philox(seed, {i, 0, 0, 0}), b = philox(seed, {i, 1, 0, 0});
    sources[i].position_m = {static_cast<float>(unit(a[0])), static_cast<float>(unit(a[1])),
                             static_cast<float>(unit(a[2]))};
    sources[i].delay_s = static_cast<float>(unit(a[3]));
    sources[i].u = static_cast<float>(unit_above_zero(b[0]));
    sources[i].power = same_in_all_bands(static_cast<float>(std::pow(10, -6 * unit(b[1]))));
  }
  return sources;
}

double power(const std::vector<Source>& sources, float below_x) {
  double sum = 0;
  for (const Source& source : sources)
    if (source.position_m.x < below_x) sum += static_cast<double>(source.power[2]);
  return sum;
}

TEST(SourceThinning, KeepsListsThatFitUnchanged) {
  const auto all = deposits(100, 1);
  SourceThinning thinning(100);
  thinning.add(all);
  const auto kept = thinning.take().take_vector();
  ASSERT_EQ(kept.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(kept[i].power, all[i].power);
    EXPECT_EQ(kept[i].position_m, all[i].position_m);
  }
}

double weight(const Source& source) { return std::pow(8.0 * source.power[0], 0.75); }

TEST(SourceThinning, KeepsTheRequestedNumberAndIsUnbiasedForAnySubset_NoAsan) {
  double whole = 0, part = 0, all_whole = 0, all_part = 0, variance = 0, part_variance = 0;
  constexpr int kSeeds = 400;
  constexpr std::size_t kKept = 200;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto all = deposits(2000, seed);
    SourceThinning thinning(kKept);
    thinning.add(all);
    const auto kept = thinning.take().take_vector();
    ASSERT_EQ(kept.size(), kKept);
    whole += power(kept, 2);
    part += power(kept, 0.3f);
    all_whole += power(all, 2);
    all_part += power(all, 0.3f);
    // A source is kept with probability w / tau, tau about the sum of w over k, so its variance is
    // at most P^2 tau / w.
    double tau = 0;
    for (const Source& source : all) tau += weight(source) / (kKept - 1);
    for (const Source& source : all) {
      const double most = std::pow(source.power[2], 2) * tau / weight(source);
      variance += most;
      if (source.position_m.x < 0.3f) part_variance += most;
    }
  }
  EXPECT_NEAR(whole, all_whole, 3 * std::sqrt(variance));
  EXPECT_NEAR(part, all_part, 3 * std::sqrt(part_variance));
}

TEST(SourceThinning, DropsNoDepositAboveTheThreshold) {
  const auto all = deposits(20000, 5);
  SourceThinning thinning(12000);
  thinning.add(all);
  const auto kept = thinning.take().take_vector();
  std::map<float, float> power_at;  // by position
  for (const Source& source : kept) power_at[source.position_m.x] = source.power[0];
  float min_unchanged = 1e9f;
  for (const Source& source : all)
    if (power_at.contains(source.position_m.x) && power_at[source.position_m.x] == source.power[0])
      min_unchanged = std::min(min_unchanged, source.power[0]);
  ASSERT_LT(min_unchanged, 1.0f);
  for (const Source& source : all)
    if (source.power[0] > 1.0001f * min_unchanged) {
      EXPECT_TRUE(power_at.contains(source.position_m.x));
    }
}

TEST(SourceThinning, KeepsTheSameInMemoryAndInAFileHoweverDepositsAreGrouped) {
  const std::string beside = ::testing::TempDir() + "/clamor_thin_" + std::to_string(::getpid());
  for (const int kind : {0, 1, 2}) {
    // With few places and keys, many deposits are equal, and the first of them are kept.
    const auto all = kind == 0   ? deposits(50'000, 9)
                     : kind == 1 ? testing::degenerate_sources(50'000, 1, {.keys = 3, .places = 2})
                                 : testing::degenerate_sources(50'000, 1, {.keys = 1, .places = 1});
    for (const std::uint64_t max : {1u, 999u, 20'000u, 49'999u, 50'000u, 60'000u}) {
      SourceThinning whole(max), parts(max);
      whole.add(all);
      ASSERT_TRUE(parts.use_file(beside).ok());
      for (std::size_t first = 0; first < all.size(); first += 700)
        parts.add(std::span(all).subspan(first, std::min<std::size_t>(700, all.size() - first)));
      const auto expected = whole.take().take_vector();
      auto list = parts.take();
      ASSERT_TRUE(list.is_in_file());
      ASSERT_EQ(list.size(), std::min<std::size_t>(max, all.size()));
      ASSERT_EQ(list.size(), expected.size());
      for (std::size_t i = 0; i < expected.size(); ++i) {
        ASSERT_EQ(list.all()[i].position_m, expected[i].position_m) << kind << ", " << max;
        ASSERT_EQ(list.all()[i].power, expected[i].power) << kind << ", " << max;
        ASSERT_EQ(list.all()[i].u, expected[i].u) << kind << ", " << max;
      }
    }
  }
}

TEST(SourceThinning, KeepsTheOrderOfDeposits) {
  const auto all = deposits(40'000, 7);
  SourceThinning thinning(3000);
  thinning.add(all);
  const auto kept = thinning.take().take_vector();
  std::size_t at = 0;
  for (const Source& source : all)
    if (at < kept.size() && source.position_m == kept[at].position_m) ++at;
  EXPECT_EQ(at, kept.size());
}

TEST(SourceThinning, DrawsIndependentlyOfTheSourcesOwnNumbers) {
  // If u decided, kept sources would have small u. The sampler needs uniform ones.
  SourceThinning thinning(2000);
  thinning.add(deposits(100000, 3));
  double sum = 0;
  const auto kept = thinning.take().take_vector();
  for (const Source& source : kept) sum += static_cast<double>(source.u);
  EXPECT_NEAR(sum / 2000, 0.5, 4 * std::sqrt(1.0 / 12 / 2000));
}

TEST(SourceThinning, UsesLittleMoreMemoryThanItsResult) {
  if (testing::kSanitized) GTEST_SKIP() << "a sanitizer keeps what is freed";
  constexpr std::uint64_t kKept = 1'000'000, kList_bytes = kKept * sizeof(Source);
  const testing::PeakMemory peak;
  if (!peak.known()) GTEST_SKIP() << "this system does not tell how much memory was used at most";
  std::vector<Source> kept;
  {
    SourceThinning thinning(kKept);
    for (std::uint32_t part = 0; part < 60; ++part) thinning.add(deposits(50'000, part));
    kept = thinning.take().take_vector();
  }
  ASSERT_EQ(kept.size(), kKept);
  EXPECT_LE(peak.more_bytes(), 2 * kList_bytes);
  EXPECT_GE(peak.more_bytes(), kList_bytes);  // less would mean that the measurement failed
}

}  // namespace
}  // namespace clamor
