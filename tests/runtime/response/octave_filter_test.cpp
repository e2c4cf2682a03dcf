#include "runtime/response/octave_filter.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "common/sample_rate.h"

namespace clamor {
namespace {

// Spectrum at one frequency with time 0 at `centre`, so a zero-phase signal has a real spectrum.
std::complex<double> spectrum_around(const std::vector<double>& signal, double f_hz,
                                     std::size_t centre) {
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < signal.size(); ++i)
    sum += signal[i] * std::polar(1.0, -2 * std::numbers::pi * f_hz / kSampleRate_hz *
                                           (static_cast<double>(i) - static_cast<double>(centre)));
  return sum;
}

double amplitude_db(std::complex<double> amplitude) { return 20 * std::log10(std::abs(amplitude)); }

std::array<std::vector<double>, kBandCount> pulse_in(std::size_t band) {
  std::array<std::vector<double>, kBandCount> bands;
  for (auto& signal : bands) signal.assign(9601, 0);
  bands[band][4800] = 1;
  return bands;
}

TEST(SumOfBands, OfEqualBandsIsTheSignalItself) {
  std::array<std::vector<double>, kBandCount> bands;
  for (auto& signal : bands) signal = {0, 1, -0.5, 0.25, 0, 0, 3};
  EXPECT_EQ(sum_of_bands(bands), bands[0]);
}

TEST(SumOfBands, GivesEachBandTheMixersMagnitudeAndNoPhase) {
  // M_b = L_{b+1} - L_b, L = 1 / (1 + (f / edge)^8) with both frequencies warped.
  const auto low = [](double f_hz, double edge_hz) {
    const auto warp = [](double hz) { return std::tan(std::numbers::pi * hz / kSampleRate_hz); };
    return 1 / (1 + std::pow(warp(f_hz) / warp(edge_hz), 8));
  };
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const std::vector<double> band = sum_of_bands(pulse_in(b));
    for (const double f_hz : {40.0, 63.0, 125.0, 177.0, 1000.0, 1414.0, 4000.0, 8000.0, 17000.0}) {
      const double below = b == 0 ? 0 : low(f_hz, band_edge_hz(b - 1, b));
      const double above = b == 7 ? 1 : low(f_hz, band_edge_hz(b, b + 1));
      const std::complex<double> heard = spectrum_around(band, f_hz, 4800);
      // The window has 0.1 s on either side; the ringing of the 63 Hz band beyond it is below 1e-4.
      EXPECT_NEAR(heard.real(), above - below, 1e-4) << "band " << b << " at " << f_hz << " Hz";
      EXPECT_NEAR(heard.imag(), 0, 1e-4);
    }
  }
}

TEST(OctaveOf, StaysWithinTheLimitsOfIec61260Class1) {
  // IEC 61260-1:2014, table 1, class 1: attenuation relative to mid-band at G^x, G = 10^0.3.
  struct Limit {
    double octaves, min_db, max_db;
  };
  constexpr double kNone = 1e9;
  const Limit limits[] = {{0, -0.4, 0.4},       {1.0 / 8, -0.4, 0.5}, {1.0 / 4, -0.4, 0.7},
                          {3.0 / 8, -0.4, 1.4}, {0.4999, -0.4, 5.3},  {0.5001, 1.2, kNone},
                          {1, 16.6, kNone},     {2, 40.5, kNone}};
  const std::vector<double> impulse = {1};
  for (const std::size_t b : {0u, 4u, 7u}) {
    const std::vector<double> octave = octave_of(impulse, b);
    const double mid_hz = 1000 * std::pow(10, 0.3 * (static_cast<double>(b) - 4));
    const double reference_db = amplitude_db(spectrum_around(octave, mid_hz, kOctaveRing));
    EXPECT_NEAR(reference_db, 0, 0.2);
    for (const Limit& limit : limits)
      for (const double side : {-1, 1}) {
        const double f_hz = mid_hz * std::pow(10, 0.3 * side * limit.octaves);
        if (f_hz > 20000) continue;
        const double loss_db =
            reference_db - amplitude_db(spectrum_around(octave, f_hz, kOctaveRing));
        EXPECT_GE(loss_db, limit.min_db) << "band " << b << " at " << f_hz << " Hz";
        EXPECT_LE(loss_db, limit.max_db) << "band " << b << " at " << f_hz << " Hz";
      }
  }
}

TEST(OctaveGain, IsTheSpectrumOfTheOctaveOfAnImpulse) {
  for (const std::size_t b : {0u, 3u, 7u}) {
    const std::vector<double> octave = octave_of(std::vector<double>{1}, b);
    for (const double f_hz :
         {20.0, 45.0, 63.0, 90.0, 355.0, 500.0, 1000.0, 5600.0, 8000.0, 16000.0})
      EXPECT_NEAR(std::abs(spectrum_around(octave, f_hz, kOctaveRing)), octave_gain(b, f_hz), 1e-6)
          << "band " << b << " at " << f_hz << " Hz";
  }
  EXPECT_EQ(octave_gain(0, 0), 0);
}

TEST(OctaveOf, HasDecayedAtItsEnd) {
  const std::vector<double> octave = octave_of(std::vector<double>{1}, 0);
  double peak = 0;
  for (const double x : octave) peak = std::max(peak, std::abs(x));
  EXPECT_LT(std::abs(octave.front()), 1e-6 * peak);
  EXPECT_LT(std::abs(octave.back()), 1e-6 * peak);
}

}  // namespace
}  // namespace clamor
