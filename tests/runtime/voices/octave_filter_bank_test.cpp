#include "runtime/voices/octave_filter_bank.h"

#include <cmath>
#include <complex>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "common/random.h"
#include "common/sample_rate.h"

namespace clamor {
namespace {

// Left channel of layers that are sent to the bands with these gains, `steps` steps per call.
std::vector<float> heard(const OctaveFilterBank::Layers& layers, const Bands& gains,
                         std::size_t frames, int steps = kMaxSteps) {
  const auto bank = std::make_unique<OctaveFilterBank>();
  const auto buses = std::make_unique<MixBuses>();
  const auto at = [](const std::vector<double>& layer, std::size_t k) {
    return k < layer.size() ? static_cast<float>(layer[k]) : 0;
  };
  std::vector<float> out, stereo(2 * kMaxFrames);
  while (out.size() < frames) {
    const std::size_t done = out.size(), call = static_cast<std::size_t>(steps) * kStepFrames;
    for (std::size_t f = 0; f < call; ++f)
      for (std::size_t b = 0; b < kHighBands; ++b)
        buses->high[static_cast<std::size_t>(band_lane(b, 0)) * kMaxFrames + f] =
            gains[kLowBands + b] * at(layers.high, done + f);
    for (std::size_t f = 0; f < call / kLowRate; ++f)
      for (std::size_t b = 0; b < kLowBands; ++b)
        buses->low[static_cast<std::size_t>(band_lane(b, 0)) * (kMaxFrames / kLowRate) + f] =
            gains[b] * at(layers.low, done / kLowRate + f);
    bank->process(*buses, static_cast<int>(call), stereo.data());
    for (std::size_t f = 0; f < call; ++f) {
      out.push_back(stereo[2 * f]);
      EXPECT_EQ(stereo[2 * f + 1], 0);  // the right channel gets nothing
    }
  }
  return out;
}

// Output frame of an impulse at frame 0: after the tail that precedes a signal that does not loop.
constexpr std::size_t kZero = kBankTailFrames + kBankDelayFrames;

// Response relative to an impulse at kZero, so a zero-phase filter has a real response.
std::complex<double> response(const std::vector<float>& samples, double frequency_hz) {
  std::complex<double> sum = 0;
  for (std::size_t n = 0; n < samples.size(); ++n) {
    const double from_zero = static_cast<double>(n) - static_cast<double>(kZero);
    sum += static_cast<double>(samples[n]) *
           std::polar(1.0, -2 * std::numbers::pi * frequency_hz * from_zero / kSampleRate_hz);
  }
  return sum;
}

const OctaveFilterBank::Layers& impulse() {
  static const OctaveFilterBank::Layers kLayers = OctaveFilterBank::part({1}, false);
  return kLayers;
}

TEST(OctaveFilterBank, ReconstructsAnImpulseWithUnityGains) {
  const auto out = heard(impulse(), same_in_all_bands(1), 2 * kBankTailFrames);
  for (std::size_t n = 0; n < out.size(); ++n)
    ASSERT_NEAR(out[n], n == kZero ? 1 : 0, 1e-4) << n;  // -80 dB
  for (double f = 20; f < 18000; f *= 1.1)
    EXPECT_NEAR(20 * std::log10(std::abs(response(out, f))), 0, 0.01) << f << " Hz";
}

TEST(OctaveFilterBank, ReconstructsALoopOfAnyLengthWithUnityGains) {
  for (const std::uint32_t length : {7000u, 7001u, 7002u, 3u, 1u}) {
    std::vector<double> noise(length);
    for (std::uint32_t i = 0; i < length; ++i) noise[i] = unit(philox(1, {i, 0, 0, 0})[0]) - 0.5;
    OctaveFilterBank::Layers layers = OctaveFilterBank::part(noise, true);
    ASSERT_EQ(layers.high.size(), length);
    ASSERT_EQ(layers.low.size() * kLowRate % length, 0u);
    for (auto* layer : {&layers.high, &layers.low})
      for (const std::size_t round = layer->size(); layer->size() < 60000;)
        layer->push_back((*layer)[layer->size() - round]);
    const auto out = heard(layers, same_in_all_bands(1), 40000);
    // The bank starts at rest; its transient ends within half a second.
    for (std::size_t n = 30000; n < out.size(); ++n)
      ASSERT_NEAR(out[n], noise[(n - kBankDelayFrames) % length], 1e-4) << n << " of " << length;
  }
}

TEST(OctaveFilterBank, FiltersABandByTheClosedFormInPhase) {
  for (std::size_t band = 0; band < kBandCount; ++band) {
    Bands gains{};
    gains[band] = 1;
    const auto out = heard(impulse(), gains, 3 * kBankTailFrames);
    for (const double f : {45.0, 63.0, 90.0, 125.0, 250.0, 500.0, 700.0, 1000.0, 1414.0, 2000.0,
                           4000.0, 8000.0, 15000.0}) {
      EXPECT_NEAR(response(out, f).real(), OctaveFilterBank::magnitude(band, f), 1e-3)
          << band << ", " << f;
      EXPECT_NEAR(response(out, f).imag(), 0, 1e-3) << band << ", " << f;
    }
  }
}

TEST(OctaveFilterBank, SuppressesAliasesOfTheLowLayer_NoAsan) {
  // Only bands 0 to 4 sound: anything above 4 kHz would be an alias of the quarter sample rate.
  const auto out = heard(impulse(), {1, 1, 1, 1, 1, 0, 0, 0}, 3 * kBankTailFrames);
  for (double f = 4000; f < 24000; f += 50)
    EXPECT_LT(20 * std::log10(std::abs(response(out, f))), -95) << f << " Hz";
}

TEST(OctaveFilterBank, GivesATonesBandItsGainBesideAnyOthers) {
  const Bands wanted = {0.05f, 1, 0.5f, 0.02f, 0.3f, 0.1f, 0.5f, 0.01f};  // up to 34 dB per octave
  Bands bus{};
  for (std::size_t b = 0; b < kBandCount; ++b)
    for (std::size_t c = 0; c < kBandCount; ++c)
      bus[b] += static_cast<float>(OctaveFilterBank::bus_gains()[b][c]) * wanted[c];
  const auto out = heard(impulse(), bus, 3 * kBankTailFrames);
  for (std::size_t b = 0; b < kBandCount; ++b)
    EXPECT_NEAR(20 * std::log10(response(out, kBandCentres_hz[b]).real() / wanted[b]), 0, 0.1) << b;
}

TEST(OctaveFilterBank, DoesNotDependOnBlockSizes) {
  const OctaveFilterBank::Layers layers = OctaveFilterBank::part({1, -0.5, 0.25}, false);
  const Bands gains = {1, 0.5f, 0.2f, 1, 0.7f, 0.1f, 0.9f, 0.3f};
  const auto whole = heard(layers, gains, 19200, 4);
  auto single = heard(layers, gains, 19200, 1), three = heard(layers, gains, 19200, 3);
  EXPECT_EQ(whole, single);
  EXPECT_EQ(whole, three);
}

TEST(OctaveFilterBank, MeasuresThePowerOfEachBand) {
  for (std::size_t band = 0; band < kBandCount; ++band) {
    std::vector<double> tone(kSampleRate_hz);  // steps of 1 Hz have a whole number of periods
    for (std::size_t i = 0; i < tone.size(); ++i)
      tone[i] = std::sin(2 * std::numbers::pi * kBandCentres_hz[band] * static_cast<double>(i) /
                         kSampleRate_hz);
    const Bands power = OctaveFilterBank::part(tone, true).mean_square;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double m = OctaveFilterBank::magnitude(b, kBandCentres_hz[band]);
      EXPECT_NEAR(power[b], 0.5 * m * m, 0.01) << b << " of " << kBandCentres_hz[band] << " Hz";
    }
  }
}

}  // namespace
}  // namespace clamor
