#include "formats/bake_file/signal_envelope.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "common/crossover.h"
#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/level/signal_table.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

double decibels(double ratio) { return 10 * std::log10(ratio); }

Signal tone(double frequency_hz, double amplitude, int frames, bool loop = true) {
  Signal signal{"tone", {}, loop};
  for (int i = 0; i < frames; ++i)
    signal.samples.push_back(static_cast<float>(
        amplitude * std::sin(2 * std::numbers::pi * frequency_hz * i / kSampleRate_hz)));
  return signal;
}

Signal noise(int frames, bool loop) {
  Signal signal{"noise", {}, loop};
  for (int i = 0; i < frames; ++i)
    signal.samples.push_back(
        static_cast<float>(unit(philox(3, {static_cast<std::uint32_t>(i), 0, 0, 0})[0]) - 0.5));
  return signal;
}

Bands mean_of(const SignalEnvelope& envelope) {
  std::array<double, kBandCount> sum{};
  for (std::size_t m = 0; m < envelope.moments(); ++m)
    for (std::size_t b = 0; b < kBandCount; ++b) sum[b] += envelope.at(m)[b];
  Bands mean{};
  for (std::size_t b = 0; b < kBandCount; ++b)
    mean[b] = static_cast<float>(sum[b] / static_cast<double>(envelope.moments()));
  return mean;
}

// The band gain for a sine has a closed form.
TEST(SignalEnvelope, OfASteadyToneIsConstant) {
  for (const double frequency_hz : {63.0, 88.0, 500.0, 707.0, 1000.0, 8000.0}) {
    const SignalEnvelope envelope(tone(frequency_hz, 0.5, kSampleRate_hz));
    ASSERT_EQ(envelope.moments(), 50u);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      double share = 1;
      if (b > 0) share *= crossover_magnitude(b - 1, kSampleRate_hz, Side::kHigh, frequency_hz);
      if (b < kBandEdges) share *= crossover_magnitude(b, kSampleRate_hz, Side::kLow, frequency_hz);
      const double power = 0.125 * share * share;
      if (power < 1e-12) continue;
      EXPECT_NEAR(decibels(envelope.mean_square()[b] / power), 0, 0.01) << frequency_hz << " " << b;
      // 20 ms hold 1.26 periods of 63 Hz: the window leaves a little of the ripple.
      const double ripple_db = frequency_hz < 100 ? 1.5 : 0.3;
      for (std::size_t m = 0; m < envelope.moments(); ++m)
        EXPECT_NEAR(decibels(envelope.at(m)[b] / power), 0, ripple_db) << frequency_hz << " " << b;
    }
  }
}

TEST(SignalEnvelope, PreservesTheEnergyOfLoopsOfAnyLength) {
  for (const int frames : {1, 7, 959, 960, 961, 5000, 48'000, 300'001}) {
    if (testing::kSanitized && frames > 5000) continue;  // slow
    const Signal signal = noise(frames, true);
    const SignalEnvelope envelope(signal);
    ASSERT_EQ(envelope.moments(), moments_of(signal.samples.size()));
    // Repeating a sound ten times preserves its energy per second.
    Signal longer = signal;
    for (int i = 1; i < 10; ++i)
      longer.samples.insert(longer.samples.end(), signal.samples.begin(), signal.samples.end());
    const SignalEnvelope many(longer);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      if (envelope.mean_square()[b] == 0) {
        EXPECT_EQ(many.mean_square()[b], 0);
        continue;
      }
      EXPECT_NEAR(decibels(mean_of(envelope)[b] / envelope.mean_square()[b]), 0, 1e-4);
      EXPECT_NEAR(decibels(many.mean_square()[b] / envelope.mean_square()[b]), 0, 1e-3)
          << frames << " " << b;
    }
  }
}

TEST(SignalEnvelope, LocatesABurst) {
  Signal signal{"burst", std::vector<float>(2 * kSampleRate_hz, 0), false};
  const Signal burst = tone(1000, 1, kSampleRate_hz / 10);
  std::copy(burst.samples.begin(), burst.samples.end(), signal.samples.begin() + kSampleRate_hz);
  for (const bool loop : {false, true}) {
    signal.loop = loop;
    const SignalEnvelope envelope(signal);
    ASSERT_EQ(envelope.moments(), 100u);
    double inside = 0, all = 0;
    for (std::size_t m = 0; m < 100; ++m) {
      const double power = envelope.at(m)[4];
      all += power;
      if (m >= 49 && m <= 55) inside += power;
      if (m >= 51 && m <= 53) {
        EXPECT_NEAR(decibels(power / 0.5), 0, 0.35) << m;
      }
      // Filters ring for less than a tenth of a second.
      if (m < 40 || m > 65) {
        EXPECT_LT(power, 1e-9) << m;
      }
    }
    EXPECT_GT(inside / all, 0.999);
  }
}

TEST(SignalEnvelope, OfAClickHasAllEnergyInItsFirstMoment) {
  const SignalEnvelope envelope({"click", {1.0f}, false});
  ASSERT_EQ(envelope.moments(), 1u);
  // An impulse is white, so the energy of a band is the fraction of the spectrum that it passes.
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double passed = 0;
    for (double hz = 0.5; hz < kSampleRate_hz / 2; ++hz) {
      double share = 1;
      if (b > 0) share *= crossover_magnitude(b - 1, kSampleRate_hz, Side::kHigh, hz);
      if (b < kBandEdges) share *= crossover_magnitude(b, kSampleRate_hz, Side::kLow, hz);
      passed += share * share / (kSampleRate_hz / 2.0);
    }
    EXPECT_NEAR(decibels(envelope.mean_square()[b] * kMomentFrames / passed), 0, 0.01) << b;
  }
}

TEST(SignalEnvelope, OfSilenceIsSilent) {
  const SignalEnvelope envelope({"nothing", std::vector<float>(100'000, 0), true});
  EXPECT_TRUE(envelope.silent());
  EXPECT_EQ(envelope.at(7), Bands{});
  EXPECT_FALSE(SignalEnvelope(noise(100, true)).silent());
}

TEST(SignalEnvelope, DoesNotDependOnItsDivisionIntoPieces) {
  // 10 s are processed in several pieces, 1 s in one; repeated seconds have equal moments.
  const Signal second = noise(kSampleRate_hz, true);
  Signal ten = second;
  for (int i = 1; i < 10; ++i)
    ten.samples.insert(ten.samples.end(), second.samples.begin(), second.samples.end());
  const SignalEnvelope one(second), many(ten);
  for (std::size_t m = 0; m < many.moments(); ++m)
    for (std::size_t b = 0; b < kBandCount; ++b)
      EXPECT_NEAR(decibels(many.at(m)[b] / one.at(m % 50)[b]), 0, 0.51);  // half-decibel steps
}

TEST(SignalEnvelope, RejectsInvalidSteps) {
  const Bands power = same_in_all_bands(0.1f);
  EXPECT_TRUE(SignalEnvelope::from_steps(power, std::vector<std::uint8_t>(8, 255)).ok());
  EXPECT_FALSE(SignalEnvelope::from_steps(power, {}).ok());
  EXPECT_FALSE(SignalEnvelope::from_steps(power, std::vector<std::uint8_t>(9, 255)).ok());
  EXPECT_FALSE(SignalEnvelope::from_steps(power, std::vector<std::uint8_t>(8, 254)).ok());
  EXPECT_FALSE(SignalEnvelope::from_steps(Bands{}, std::vector<std::uint8_t>(8, 255)).ok());
  for (const float wrong : {-1.0f, NAN, INFINITY, 1e20f}) {
    Bands bands = power;
    bands[6] = wrong;
    EXPECT_FALSE(SignalEnvelope::from_steps(bands, std::vector<std::uint8_t>(8, 255)).ok());
  }
}

}  // namespace
}  // namespace clamor
