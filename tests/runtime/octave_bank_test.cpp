#include "runtime/octave_bank.h"

#include <cmath>
#include <complex>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "common/random.h"
#include "formats/level.h"

namespace clamor {
namespace {

// What the left ear hears of `samples` sent to the bands with these gains, phase undone first.
std::vector<float> heard(std::vector<double> samples, bool loop, const Bands& gains,
                         std::size_t frames, int chunk = kStepFrames) {
  OctaveBank::undo_phase(samples, loop);
  const auto bank = std::make_unique<OctaveBank>();
  std::vector<float> out, bus(static_cast<std::size_t>(kStepFrames) * kBusLanes);
  std::vector<float> stereo(2 * kStepFrames);
  for (std::size_t done = 0; done < frames; done += static_cast<std::size_t>(chunk)) {
    for (int f = 0; f < chunk; ++f) {
      const std::size_t at = done + static_cast<std::size_t>(f);
      const double x = loop ? samples[at % samples.size()] : at < samples.size() ? samples[at] : 0;
      for (std::size_t b = 0; b < kBandCount; ++b) {
        bus[static_cast<std::size_t>(f * kBusLanes + bus_lane(b, 0))] =
            gains[b] * static_cast<float>(x);
        bus[static_cast<std::size_t>(f * kBusLanes + bus_lane(b, 1))] = 0;
      }
    }
    bank->process(bus.data(), chunk, stereo.data());
    for (int f = 0; f < chunk; ++f) out.push_back(stereo[static_cast<std::size_t>(2 * f)]);
  }
  return out;
}

std::complex<double> at_frequency(const std::vector<float>& samples, double frequency_hz) {
  std::complex<double> sum = 0;
  for (std::size_t n = 0; n < samples.size(); ++n)
    sum += static_cast<double>(samples[n]) *
           std::polar(
               1.0, -2 * std::numbers::pi * frequency_hz * static_cast<double>(n) / kSampleRate_hz);
  return sum;
}

TEST(OctaveBank, GivesBackAnImpulseWhenAllGainsAreOne) {
  const auto out = heard({1}, false, same_in_all_bands(1), 2 * kBankTailFrames);
  ASSERT_GT(out.size(), static_cast<std::size_t>(kBankTailFrames));
  for (std::size_t n = 0; n < out.size(); ++n)
    EXPECT_NEAR(out[n], n == kBankTailFrames ? 1 : 0, 1e-4) << n;  // -80 dB
  for (double f = 20; f < 18000; f *= 1.1)
    EXPECT_NEAR(20 * std::log10(std::abs(at_frequency(out, f))), 0, 0.1) << f << " Hz";
}

TEST(OctaveBank, GivesBackALoopWhenAllGainsAreOne) {
  std::vector<double> noise(7001);
  for (std::uint32_t i = 0; i < noise.size(); ++i)
    noise[i] = unit(philox(1, {i, 0, 0, 0})[0]) - 0.5;
  const auto out = heard(noise, true, same_in_all_bands(1), 64 * 600);
  // The bank starts from rest; after a second its own tail is over.
  for (std::size_t n = 30000; n < out.size(); ++n)
    ASSERT_NEAR(out[n], noise[n % noise.size()], 1e-4) << n;
}

TEST(OctaveBank, PassesABandAsTheClosedFormSaysAndInPhase) {
  for (std::size_t band = 0; band < kBandCount; ++band) {
    Bands gains{};
    gains[band] = 1;
    const auto out = heard({1}, false, gains, 3 * kBankTailFrames);
    for (const double f :
         {45.0, 63.0, 90.0, 125.0, 500.0, 700.0, 1000.0, 4000.0, 8000.0, 15000.0}) {
      // Relative to the impulse at kBankTailFrames, a zero-phase filter's response is its
      // magnitude.
      const auto response =
          at_frequency(out, f) *
          std::polar(1.0, 2 * std::numbers::pi * f * kBankTailFrames / kSampleRate_hz);
      EXPECT_NEAR(response.real(), OctaveBank::magnitude(band, f), 1e-3) << band << ", " << f;
      EXPECT_NEAR(response.imag(), 0, 1e-3) << band << ", " << f;
    }
  }
}

TEST(OctaveBank, DoesNotDependOnHowCallsDivideTime) {
  const Bands gains = {1, 0.5f, 0.2f, 1, 0.7f, 0.1f, 0.9f, 0.3f};
  const auto whole = heard({1, -0.5, 0.25}, false, gains, 6400, 64);
  EXPECT_EQ(whole, heard({1, -0.5, 0.25}, false, gains, 6400, 1));
  EXPECT_EQ(whole, heard({1, -0.5, 0.25}, false, gains, 6400, 16));
}

}  // namespace
}  // namespace clamor
