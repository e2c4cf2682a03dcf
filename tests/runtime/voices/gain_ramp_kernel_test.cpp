// gain_ramp_kernel_test.cpp: vectorized gains of buses against scalar sums.
#include "runtime/voices/gain_ramp_kernel.h"

#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/voices/octave_filter_bank.h"
#include "tests/runtime/instruction_sets.h"

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

using GainRampKernel = testing::OnInstructionSet;
INSTANTIATE_TEST_SUITE_P(EveryInstructionSet, GainRampKernel, testing::every_instruction_set(),
                         testing::instruction_set_name);

TEST_P(GainRampKernel, GivesEachBusTheSumOverOctavesOfItsMatrix) {
  const BusGains buses = BusGains::of(OctaveFilterBank::bus_gains());
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    const auto gains = some_gains(seed);
    std::array<float, kLanes> lanes;
    bus_lanes(buses, gains, lanes.data());
    for (std::size_t b = 0; b < kBandCount; ++b)
      for (int ear = 0; ear < kEars; ++ear) {
        double sum = 0;
        for (std::size_t c = 0; c < kBandCount; ++c)
          sum += OctaveFilterBank::bus_gains()[b][c] *
                 static_cast<double>(gains[static_cast<std::size_t>(ear)][c]);
        EXPECT_NEAR(lanes[static_cast<std::size_t>(band_lane(b, ear))], sum, 1e-6);
      }
  }
}

TEST_P(GainRampKernel, RampsFromTheCurrentGainsToTheGoals) {
  for (const std::size_t count : {std::size_t{kHrtfLanes}, kLanes, std::size_t{kEars}})
    for (const bool starts : {false, true}) {
      std::array<float, kHrtfLanes> target, before, targets;
      std::array<float, 2 * kHrtfLanes> gain;
      for (std::size_t lane = 0; lane < target.size(); ++lane) {
        before[lane] = target[lane] = 0.1f * static_cast<float>(lane % kLanes);
        targets[lane] = 1 - 0.05f * static_cast<float>(lane % kLanes);
      }
      constexpr int kFrames = 320;
      EXPECT_TRUE(ramp_gains({target.data(), gain.data(), targets.data(), count, kFrames, starts}));
      for (std::size_t lane = 0; lane < count; ++lane) {
        EXPECT_EQ(gain[lane], starts ? 0 : before[lane]);
        EXPECT_NEAR(gain[lane] + gain[count + lane] * kFrames / kGainFrames, targets[lane], 1e-6);
        EXPECT_EQ(target[lane], targets[lane]);
      }
    }
}

TEST_P(GainRampKernel, TellsWhichGainsAreInaudible) {
  std::array<float, kLanes> target{}, targets{};
  std::array<float, 2 * kLanes> gain{};
  const auto heard = [&] {
    return ramp_gains({target.data(), gain.data(), targets.data(), kLanes, 960, false});
  };
  EXPECT_FALSE(heard());
  targets[kLanes - 1] = -1e-30f;
  EXPECT_TRUE(heard());
  targets = {};
  EXPECT_TRUE(heard()) << "the gain falls to zero";
  EXPECT_FALSE(heard());
}

TEST_P(GainRampKernel, InterpolatesTheEqualizationBetweenThreeDirectionsAndAddsThePowerToThem) {
  const BusGains buses = BusGains::of(OctaveFilterBank::bus_gains());
  const auto own = some_gains(1);
  const Bands mean_square = some_gains(2)[0];
  const std::array<std::array<Bands, kEars>, 3> levels = {some_gains(3), some_gains(4),
                                                          some_gains(5)};
  std::array<std::array<Bands, kEars>, 3> powers = {some_gains(6), some_gains(7), some_gains(8)};
  const auto before = powers;
  constexpr std::array<float, 3> kShares = {0.2f, 0.7f, 0.1f};
  std::array<HrtfCorner, 3> corners;
  std::array<Bands, kEars> coloured{};
  for (std::size_t k = 0; k < corners.size(); ++k) {
    corners[k] = {&levels[k], &powers[k], kShares[k]};
    for (std::size_t e = 0; e < kEars; ++e)
      for (std::size_t b = 0; b < kBandCount; ++b)
        coloured[e][b] += kShares[k] * levels[k][e][b] * own[e][b];
  }
  std::array<float, kLanes> target{}, wanted;
  std::array<float, 2 * kLanes> gain{};
  EXPECT_TRUE(ramp_hrtf_gains(buses, corners, own, mean_square,
                              {target.data(), gain.data(), nullptr, kLanes, 960, true}));
  bus_lanes(buses, coloured, wanted.data());
  for (std::size_t lane = 0; lane < kLanes; ++lane) EXPECT_NEAR(target[lane], wanted[lane], 1e-6);
  for (std::size_t k = 0; k < corners.size(); ++k)
    for (std::size_t e = 0; e < kEars; ++e)
      for (std::size_t b = 0; b < kBandCount; ++b)
        EXPECT_NEAR(powers[k][e][b],
                    before[k][e][b] + kShares[k] * mean_square[b] * own[e][b] * own[e][b], 1e-6);
}

}  // namespace
}  // namespace clamor
