// Gains of buses in vectors against the sums they stand for, one by one.
#include "runtime/gain_kernel.h"

#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/octave_bank.h"

namespace clamor {
namespace {

constexpr auto kLanes = static_cast<std::size_t>(kBandLanes);

std::array<Bands, kEars> some_gains(std::uint32_t seed) {
  std::array<Bands, kEars> gains;
  for (std::uint32_t e = 0; e < kEars; ++e)
    for (std::uint32_t b = 0; b < kBandCount; ++b)
      gains[e][b] = static_cast<float>(unit(philox(seed, {e, b, 0, 0})[0]));
  return gains;
}

class GainKernel : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { force_mix_kernel(GetParam()); }
  void TearDown() override { force_mix_kernel(""); }
};

TEST_P(GainKernel, GivesEachBusTheSumOverOctavesThatItsMatrixSays) {
  const BusGains buses = BusGains::of(OctaveBank::bus_gains());
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    const auto gains = some_gains(seed);
    std::array<float, kLanes> lanes;
    bus_lanes(buses, gains, lanes.data());
    for (std::size_t b = 0; b < kBandCount; ++b)
      for (int ear = 0; ear < kEars; ++ear) {
        double sum = 0;
        for (std::size_t c = 0; c < kBandCount; ++c)
          sum += OctaveBank::bus_gains()[b][c] *
                 static_cast<double>(gains[static_cast<std::size_t>(ear)][c]);
        EXPECT_NEAR(lanes[static_cast<std::size_t>(band_lane(b, ear))], sum, 1e-6);
      }
  }
}

TEST_P(GainKernel, SlidesFromWhereGainsAreToWhereTheyAreToBe) {
  for (const std::size_t count : {std::size_t{kHeadLanes}, kLanes, std::size_t{kEars}})
    for (const bool starts : {false, true}) {
      std::array<float, kHeadLanes> target, before, targets;
      std::array<float, 2 * kHeadLanes> gain;
      for (std::size_t lane = 0; lane < target.size(); ++lane) {
        before[lane] = target[lane] = 0.1f * static_cast<float>(lane % kLanes);
        targets[lane] = 1 - 0.05f * static_cast<float>(lane % kLanes);
      }
      constexpr int kFrames = 320;
      EXPECT_TRUE(
          slide_gains({target.data(), gain.data(), targets.data(), count, kFrames, starts}));
      for (std::size_t lane = 0; lane < count; ++lane) {
        EXPECT_EQ(gain[lane], starts ? 0 : before[lane]);
        EXPECT_NEAR(gain[lane] + gain[count + lane] * kFrames / kGainFrames, targets[lane], 1e-6);
        EXPECT_EQ(target[lane], targets[lane]);
      }
    }
}

TEST_P(GainKernel, KnowsWhatIsNotHeard) {
  std::array<float, kLanes> target{}, targets{};
  std::array<float, 2 * kLanes> gain{};
  const auto heard = [&] {
    return slide_gains({target.data(), gain.data(), targets.data(), kLanes, 960, false});
  };
  EXPECT_FALSE(heard());
  targets[kLanes - 1] = -1e-30f;
  EXPECT_TRUE(heard());
  targets = {};
  EXPECT_TRUE(heard()) << "it goes down to silence";
  EXPECT_FALSE(heard());
}

INSTANTIATE_TEST_SUITE_P(AllInstructionSets, GainKernel, ::testing::ValuesIn(mix_kernel_targets()));

}  // namespace
}  // namespace clamor
