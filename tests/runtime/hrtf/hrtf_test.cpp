// hrtf_test.cpp: binaural mixing against convolution with the measured responses.
#include "runtime/hrtf/hrtf.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "runtime/hrtf/hrtf_magnitude_fit.h"
#include "runtime/mixing/mixer.h"
#include "runtime/voices/mix_fir.h"
#include "tests/rooms.h"
#include "tests/runtime/hrtf_mixing.h"

namespace clamor {
namespace {

using namespace testing;

// Compares levels; interaural_times_test.cpp compares the time between the ears band by band.
TEST(Binaural, EqualsConvolutionWithTheHrtfFromTwoHundredDirections_NoAsan) {
  // of the mix, relative to the measured response
  std::vector<std::array<ErbBands, kEars>> level_db;
  for (const std::size_t d : two_hundred()) {
    const auto& out = mixed_click(d);
    std::array<Spectrum, kEars> ours, direct;
    auto& over_db = level_db.emplace_back();
    const double bin_hz = kemar().rate_hz / kSize;
    for (std::size_t e = 0; e < kEars; ++e) {
      ours[e] = spectrum_of(out[e].data(), out[e].size());
      direct[e] = spectrum_of(kemar().response(d, e), kemar().frames);
      const ErbBands energy = energy_of(ours[e], kBin_hz), expected = energy_of(direct[e], bin_hz);
      for (std::size_t b = 0; b < kErbBandCount; ++b)
        over_db[e][b] = 10 * std::log10(energy[b] / expected[b]);
    }
    for (std::size_t b = 0; b < kErbBandCount; ++b)
      EXPECT_NEAR(over_db[0][b], over_db[1][b], 1) << "band " << b << ", direction " << d;
  }
  // Each ear and band agrees as well, apart from what all directions have in common.
  for (std::size_t b = 0; b < kErbBandCount; ++b) {
    double common_db = 0;
    for (const auto& ears : level_db)
      common_db += (ears[0][b] + ears[1][b]) / static_cast<double>(kEars * level_db.size());
    for (const auto& ears : level_db)
      for (const ErbBands& ear : ears) EXPECT_NEAR(ear[b], common_db, 1) << b;
  }
}

// A diffuse field is as loud in each band as without an HRTF.
TEST(Binaural, AddsNoColourInTheMeanOverAllDirections_NoAsan) {
  const HrtfMagnitudeFit fit;
  ErbBands sum{}, flat = fit.energy_of([] {
    std::array<double, kHrtfBands> ones;
    ones.fill(1);
    return ones;
  }());
  for (const Vec3f& from : kemar().directions)
    for (const HrtfGains& levels : kemar_head().gains(from)) {
      std::array<double, kHrtfBands> heard_levels;
      std::ranges::copy(levels, heard_levels.begin());
      const ErbBands energy = fit.energy_of(heard_levels);
      for (std::size_t b = 0; b < kErbBandCount; ++b)
        sum[b] += energy[b] / static_cast<double>(kEars * kemar().directions.size());
    }
  for (std::size_t b = 0; b < kErbBandCount; ++b)
    EXPECT_NEAR(10 * std::log10(sum[b] / flat[b]), 0, 0.3) << b;
}

TEST(Binaural, ChangesNothingWithAnHrtfThatIsAnImpulse) {
  const Hrtf head(no_head());
  Signal noise;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-0.5f, 0.5f);
  for (int i = 0; i < 5000; ++i) noise.samples.push_back(uniform(random));
  const auto out = mixed(head, noise, 4096, [&](int k) {
    return heard(head, {0, 1, 0}, 300, 0.5f, k == 0);
  });
  double error = 0, power = 0;
  for (std::size_t n = 0; n < 4096; ++n) {
    const double expected = 0.5 * noise.samples[(n + 5000 - 300) % 5000];
    for (std::size_t e = 0; e < kEars; ++e) error += std::pow(out[e][n] - expected, 2);
    power += kEars * expected * expected;
  }
  EXPECT_LT(10 * std::log10(error / power), -50);
}

TEST(Binaural, IsTheSameOnEveryInstructionSet) {
  std::array<std::vector<float>, kEars> first;
  Signal tone;
  tone.samples = testing::sine(3000).samples;
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    const auto out = mixed(kemar_head(), tone, 3000, [&](int k) {
      return heard(kemar_head(), k % 2 == 0 ? Vec3f(1, 0, 0) : Vec3f(0, -1, 0), 500 + 7.3 * k, 0.5f,
                   k == 0);
    });
    if (first[0].empty()) first = out;
    for (std::size_t e = 0; e < kEars; ++e)
      for (std::size_t n = 0; n < out[e].size(); ++n)
        ASSERT_NEAR(out[e][n], first[e][n], 1e-5) << target << ' ' << n;
  }
  force_mix_kernel("");
}

// Gains of octaves act through the narrow bands: a tone at the centre of an octave has its gain.
TEST(Binaural, GivesEachOctaveItsGain) {
  const Hrtf head(no_head());
  std::mt19937 random(4);
  std::uniform_real_distribution<double> change_db(-6, 2);
  for (int shape = 0; shape < 20; ++shape) {
    Bands gains{};
    double level_db = 0;
    for (float& gain : gains) {
      gain = static_cast<float>(std::pow(10, level_db / 20));
      level_db += change_db(random);
    }
    const HrtfGains levels = HrtfFilters::levels_of(gains);
    const auto own = head.gains(Vec3f(1, 0, 0));
    for (std::size_t b = 0; b < kBandCount; ++b) {
      double heard_gain = 0;
      for (std::size_t j = 0; j < kHrtfBands; ++j)
        heard_gain += levels[j] * own[0][j] * HrtfFilters::magnitude(j, kBandCentres_hz[b]);
      EXPECT_NEAR(20 * std::log10(heard_gain / gains[b]), 0, 0.5) << shape << ' ' << b;
    }
  }
}

}  // namespace
}  // namespace clamor
