#include "runtime/response/impulse_response.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "common/air.h"
#include "common/material.h"
#include "common/sample_rate.h"
#include "formats/bake_file/page.h"
#include "formats/level/emitter.h"
#include "tests/peak_memory.h"

namespace clamor {
namespace {

std::complex<double> spectrum(const std::vector<float>& signal, double f_hz) {
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < signal.size(); ++i)
    sum += static_cast<double>(signal[i]) *
           std::polar(1.0, -2 * std::numbers::pi * f_hz * static_cast<double>(i) / kSampleRate_hz);
  return sum;
}

std::vector<Arrival> direct_sound(double r_m, const Air& air) {
  const std::vector<Emitter> emitters(1);
  const std::vector<Material> materials(1);
  std::vector<Source> sources(1);
  set_from_emitter(sources[0], emitters[0]);
  return energy_response(sources, emitters, materials, air, Vec3(0, 0, r_m), std::nullopt);
}

TEST(ImpulseResponse, WithAWholeDelayIsOneSample) {
  const Arrival arrival{.time_s = 100.0 / kSampleRate_hz, .energy = same_in_all_bands(0.25f)};
  const auto response = impulse_response(std::vector{arrival}, 200);
  for (std::size_t i = 0; i < response.size(); ++i)
    EXPECT_NEAR(response[i], i == 100 ? 0.5 : 0, 1e-7) << i;
}

TEST(ImpulseResponse, InAFreeFieldIsAPulseAtRByCWithLevelOneByR) {
  const Air air;
  for (const double r_m : {1.0, 2.0, 4.0, 8.0}) {
    const auto arrivals = direct_sound(r_m, air);
    const auto response = impulse_response(arrivals, whole_response_frames(arrivals));
    for (const double f_hz : {20.0, 63.0, 500.0, 1414.0, 4000.0}) {
      const std::complex<double> heard = spectrum(response, f_hz);
      // Air absorption is 0.3 dB at 4 kHz over 8 m.
      EXPECT_NEAR(20 * std::log10(std::abs(heard)), -20 * std::log10(r_m), f_hz > 1500 ? 0.3 : 0.1);
      // The phase gives the delay to a hundredth of a sample.
      const double turns = f_hz * r_m / 343.2;
      const double late_s = -std::arg(heard * std::polar(1.0, 2 * std::numbers::pi * turns)) /
                            (2 * std::numbers::pi * f_hz);
      EXPECT_NEAR(late_s * kSampleRate_hz, 0, 0.01) << r_m << " m, " << f_hz << " Hz";
    }
  }
}

TEST(ImpulseResponse, IsFlatTo18KilohertzAtAnyFractionalDelay) {
  for (const double fraction : {0.1, 0.25, 0.5, 0.77, 0.9999}) {
    const Arrival arrival{.time_s = (500 + fraction) / kSampleRate_hz,
                          .energy = same_in_all_bands(1)};
    const auto response = impulse_response(std::vector{arrival}, 1000);
    for (double f_hz = 20; f_hz <= 18000; f_hz *= 1.2)
      EXPECT_NEAR(20 * std::log10(std::abs(spectrum(response, f_hz))), 0, 0.1)
          << f_hz << " Hz at " << fraction;
    EXPECT_NEAR(20 * std::log10(std::abs(spectrum(response, 18000))), 0, 0.1);
  }
}

TEST(ImpulseResponse, GivesEachBandItsOwnLevel) {
  Arrival arrival{.time_s = 0.2, .energy = same_in_all_bands(1)};
  arrival.energy[4] = 0.01f;
  const auto response = impulse_response(std::vector{arrival}, 24000);
  // Each neighbour leaks 6 % of its amplitude into the centre of a band, and the band loses as
  // much.
  EXPECT_NEAR(std::abs(spectrum(response, 1000)), 0.1 * 0.882 + 0.118, 0.005);
  EXPECT_NEAR(std::abs(spectrum(response, 250)), 1, 0.001);
  EXPECT_NEAR(std::abs(spectrum(response, 4000)), 1, 0.001);
}

TEST(ImpulseResponse, InvertsNegativePolarity) {
  const Arrival up{.time_s = 0.01, .energy = same_in_all_bands(1)};
  const Arrival down{.time_s = 0.01, .energy = same_in_all_bands(1), .polarity = -1};
  const auto response = impulse_response(std::vector{down}, 600);
  EXPECT_NEAR(*std::min_element(response.begin(), response.end()), -1, 1e-6);
  for (const float x : impulse_response(std::vector{up, down}, 600)) EXPECT_EQ(x, 0);
}

// At 1000 km a response once took 12 GB, from the emission to the arrival.
TEST(ImpulseResponse, BeginsWithTheFirstArrivalWhereTheSoundTravelsForLong) {
  std::vector<Arrival> near;
  for (const double time_s : {0.5, 0.5101, 0.9})
    near.push_back({.time_s = time_s, .energy = same_in_all_bands(1)});
  std::vector<Arrival> far = near;
  for (Arrival& arrival : far) arrival.time_s += 2900;
  EXPECT_EQ(first_response_frame(near), 0u);
  EXPECT_EQ(first_response_frame(far), static_cast<std::size_t>(2900.5 * kSampleRate_hz));
  EXPECT_NEAR(static_cast<double>(whole_response_frames(near)), 45'601, 1);
  EXPECT_NEAR(static_cast<double>(whole_response_frames(far)), 21'601, 1);
  const std::size_t frames = whole_response_frames(near);
  const auto expected = impulse_response(near, frames);
  const auto found = impulse_response(far, frames, std::size_t{2900} * kSampleRate_hz);
  for (std::size_t i = 0; i < frames; ++i) ASSERT_NEAR(found[i], expected[i], 1e-6) << i;
}

TEST(ImpulseResponse, IsNoLongerThanAMinute) {
  std::vector<Arrival> arrivals(2, {.time_s = 1, .energy = same_in_all_bands(1)});
  arrivals.back().time_s = 1e9;  // of a forged file
  EXPECT_EQ(whole_response_frames(arrivals), std::size_t{60} * kSampleRate_hz + 1);
  EXPECT_EQ(whole_response_frames({}), 0u);
}

// Only what lies between the first arrival and the last one is filtered: 90 bytes per frame.
TEST(ImpulseResponse, TakesNoMemoryForSilence) {
  const std::vector<Arrival> late(1, {.time_s = 59, .energy = same_in_all_bands(1)});
  const testing::PeakMemory peak;
  if (!peak.known()) GTEST_SKIP() << "the kernel does not reset the peak of memory";
  const auto response = impulse_response(late, std::size_t{60} * kSampleRate_hz);
  EXPECT_LT(peak.more_bytes(), 8 * response.size());
  EXPECT_NEAR(response[std::size_t{59} * kSampleRate_hz], 1, 1e-6);
}

TEST(ImpulseResponse, OmitsArrivalsAfterItsEnd) {
  const Arrival late{.time_s = 2, .energy = same_in_all_bands(1)};
  const auto response = impulse_response(std::vector{late}, 1000);
  EXPECT_EQ(response, std::vector<float>(1000));
  EXPECT_TRUE(impulse_response({}, 0).empty());
}

}  // namespace
}  // namespace clamor
