// interaural_times_test.cpp: the time between the ears in each band, of the mixer with the default
// HRTF against convolution with its measured responses.
#include "runtime/hrtf/interaural_times.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/rooms.h"
#include "tests/runtime/hrtf_mixing.h"

namespace clamor {
namespace {

using namespace testing;
using Ears = std::array<Spectrum, kEars>;

constexpr double kFollowed_hz = 1400;  // ears follow the waveform below and the envelope above

struct Range {
  double low_hz, high_hz;
};
Range erb_band(std::size_t band) {
  const double number = static_cast<double>(band) + 1;
  return {erb_frequency_hz(number), erb_frequency_hz(number + 1)};
}

MixMode with_narrowband_voices_of(int narrowband_voices) {
  MixMode mode = kBinaural;
  mode.narrowband_voices = narrowband_voices;
  return mode;
}

// Both ears for a click from a measured direction: mixed, and by convolution.
Ears spectra_of_click(std::size_t direction, const MixMode& mode) {
  const auto& out = mixed_click(direction, mode);
  return {spectrum_of(out[0].data(), out[0].size()), spectrum_of(out[1].data(), out[1].size())};
}
Ears convolved_click(std::size_t direction) {
  return {spectrum_of(kemar().response(direction, 0), kemar().frames),
          spectrum_of(kemar().response(direction, 1), kemar().frames)};
}
const double kDirectBin_hz = kemar().rate_hz / kSize;

// Correlation of both ears within a range of frequencies, with the right one `lag_s` earlier.
std::complex<double> correlation(const Spectrum& left, const Spectrum& right, double bin_hz,
                                 const Range& range, double lag_s) {
  const auto first = static_cast<std::size_t>(range.low_hz / bin_hz + 0.5);
  const double angle = -2 * std::numbers::pi * bin_hz * lag_s;
  const double turn_re = std::cos(angle), turn_im = std::sin(angle);
  double re = std::cos(angle * static_cast<double>(first));
  double im = std::sin(angle * static_cast<double>(first)), sum_re = 0, sum_im = 0;
  // In real numbers, because products of std::complex check for infinities.
  for (std::size_t k = first; static_cast<double>(k) * bin_hz < range.high_hz; ++k) {
    const std::complex<double> l = left[k], r = right[k];
    const double cross_re = l.real() * r.real() + l.imag() * r.imag();
    const double cross_im = l.imag() * r.real() - l.real() * r.imag();
    sum_re += cross_re * re - cross_im * im;
    sum_im += cross_re * im + cross_im * re;
    const double next_re = re * turn_re - im * turn_im;
    im = re * turn_im + im * turn_re;
    re = next_re;
  }
  return {sum_re, sum_im};
}
std::complex<double> correlation(const Ears& ears, double bin_hz, const Range& range,
                                 double lag_s) {
  return correlation(ears[0], ears[1], bin_hz, range, lag_s);
}
double energy(const Spectrum& ear, double bin_hz, const Range& range) {
  return std::abs(correlation(ear, ear, bin_hz, range, 0));
}
double coherence(const Ears& ears, double bin_hz, const Range& range, double lag_s) {
  return std::abs(correlation(ears, bin_hz, range, lag_s)) /
         std::sqrt(energy(ears[0], bin_hz, range) * energy(ears[1], bin_hz, range));
}

// Lag of the highest correlation within a range, of waveforms below kFollowed_hz and of envelopes
// above, at most `reach_s` from `near_s`.
double lag_s(const Ears& ears, double bin_hz, const Range& range, double near_s, double reach_s) {
  double best_s = near_s;
  const auto look = [&](double reach, double step_s) {
    double best = -1e300;
    const double middle_s = best_s;
    for (double lag = middle_s - reach; lag <= middle_s + reach; lag += step_s) {
      const auto sum = correlation(ears, bin_hz, range, lag);
      const double value = range.low_hz < kFollowed_hz ? sum.real() : std::abs(sum);
      if (value <= best) continue;
      best = value;
      best_s = lag;
    }
  };
  look(reach_s, 10e-6);
  look(10e-6, 0.5e-6);
  return best_s;
}
double broad_lag_s(const Ears& ears, double bin_hz) {
  return lag_s(ears, bin_hz, {90, 850}, 0, 1e-3);
}

// Bands below 86 Hz, whose period is longer than the response, are undetermined.
bool is_told(std::size_t band) {
  return erb_band_centre_hz(band) * static_cast<double>(kemar().frames) >= kemar().rate_hz;
}
// Half a period around the broadband lag; beyond it the adjacent period would match.
double reach_s(std::size_t band) { return std::min(0.5 / erb_band_centre_hz(band), 0.5e-3); }

double tolerance_s(double time_s) { return std::max(20e-6, 0.05 * std::abs(time_s)); }

TEST(Binaural, HasTheInterauralTimeOfConvolutionInEveryErbBandBelow1400Hz_NoAsan) {
  std::size_t bands = 0;
  for (const std::size_t d : two_hundred()) {
    const Ears made = spectra_of_click(d, kBinaural), measured = convolved_click(d);
    const double near_s = broad_lag_s(measured, kDirectBin_hz);
    for (std::size_t b = 0; b < kPhaseBands; ++b) {
      if (!is_told(b)) continue;
      const double expected_s = lag_s(measured, kDirectBin_hz, erb_band(b), near_s, reach_s(b));
      // The lag is well defined: the ears are coherent.
      ASSERT_GT(coherence(measured, kDirectBin_hz, erb_band(b), expected_s), 0.8) << b << ' ' << d;
      EXPECT_NEAR(lag_s(made, kBin_hz, erb_band(b), expected_s, reach_s(b)), expected_s,
                  tolerance_s(expected_s))
          << erb_band_centre_hz(b) << " Hz, direction " << d;
      ++bands;
    }
  }
  EXPECT_EQ(bands, 15 * two_hundred().size());  // 105 Hz to 1275 Hz
}

// Envelopes of all frequencies above 1400 Hz. Sound diffracts around the head on more than one
// path, so the measured lag jumps between directions; the mixer uses the mean there, so that
// turning the head causes no jump.
TEST(Binaural, HasTheEnvelopeLagOfConvolutionAbove1400Hz_NoAsan) {
  constexpr Range kAbove{kFollowed_hz, 12000};
  constexpr double kSteepest_s = 25e-6;  // per degree
  std::vector<double> measured_s;
  for (std::size_t d = 0; d < kemar().directions.size(); ++d) {
    const Ears measured = convolved_click(d);
    measured_s.push_back(
        lag_s(measured, kDirectBin_hz, kAbove, broad_lag_s(measured, kDirectBin_hz), 0.4e-3));
  }
  std::size_t jumps = 0;
  for (const std::size_t d : two_hundred()) {
    bool jumps_here = false;
    for (std::size_t k = 0; k < measured_s.size(); ++k) {
      const double cosine = dot(kemar().directions[d], kemar().directions[k]);
      const double degrees = std::acos(std::min(cosine, 1.0)) * 180 / std::numbers::pi;
      jumps_here |= std::abs(measured_s[d] - measured_s[k]) > kSteepest_s * degrees + 1e-6;
    }
    jumps += jumps_here;
    if (jumps_here) continue;
    EXPECT_NEAR(lag_s(spectra_of_click(d, kBinaural), kBin_hz, kAbove, measured_s[d], 0.4e-3),
                measured_s[d], tolerance_s(measured_s[d]))
        << d;
  }
  EXPECT_LE(jumps, two_hundred().size() / 12);
}

// Voices in octaves have two lags and no phases: one for low frequencies, and one for the rest.
TEST(NarrowbandVoices, LeaveTheOtherVoicesTwoInterauralTimes) {
  for (const std::size_t d : two_hundred()) {
    const Ears made = spectra_of_click(d, with_narrowband_voices_of(0)),
               measured = convolved_click(d);
    const double near_s = broad_lag_s(measured, kDirectBin_hz);
    EXPECT_NEAR(broad_lag_s(made, kBin_hz), near_s, std::max(25e-6, 0.05 * std::abs(near_s))) << d;
    for (std::size_t b = 0; b < kPhaseBands; ++b) {
      if (!is_told(b)) continue;
      const double expected_s = lag_s(measured, kDirectBin_hz, erb_band(b), near_s, reach_s(b));
      const double error_s = lag_s(made, kBin_hz, erb_band(b), expected_s, reach_s(b)) - expected_s;
      EXPECT_LT(std::abs(error_s), 180e-6) << erb_band_centre_hz(b) << " Hz, direction " << d;
    }
  }
}

// Powers and cross-spectra of many uncorrelated voices add. The just noticeable difference is 0.075
// (binaural_cues.h).
TEST(NarrowbandVoices, LeaveADiffuseCrowdAsWideAsConvolution) {
  if (kSanitized) GTEST_SKIP() << "needs all 200 directions, and sanitizers test 40";
  struct Sums {
    std::array<double, kErbBandCount> left{}, right{};
    std::array<std::vector<std::complex<double>>, kErbBandCount> cross;
  } sums[2];
  constexpr int kLags = 100;  // of 10 us to either side
  for (const std::size_t d : two_hundred())
    for (const int mixed_here : {0, 1}) {
      const Ears ears =
          mixed_here == 0 ? convolved_click(d) : spectra_of_click(d, with_narrowband_voices_of(0));
      const double bin_hz = mixed_here == 0 ? kDirectBin_hz : kBin_hz;
      Sums& sum = sums[mixed_here];
      for (std::size_t b = 0; b < kErbBandCount; ++b) {
        const Range range = erb_band(b);
        sum.left[b] += energy(ears[0], bin_hz, range);
        sum.right[b] += energy(ears[1], bin_hz, range);
        sum.cross[b].resize(2 * kLags + 1);
        for (int lag = -kLags; lag <= kLags; ++lag)
          sum.cross[b][static_cast<std::size_t>(lag + kLags)] +=
              correlation(ears, bin_hz, range, lag * 10e-6);
      }
    }
  for (std::size_t b = 0; b < kErbBandCount; ++b) {
    if (!is_told(b)) continue;
    const auto alike = [&](const Sums& sum) {
      double most = 0;
      for (const auto& at : sum.cross[b]) most = std::max(most, std::abs(at.real()));
      return most / std::sqrt(sum.left[b] * sum.right[b]);
    };
    EXPECT_NEAR(alike(sums[1]), alike(sums[0]), 0.075) << erb_band_centre_hz(b) << " Hz";
  }
}

// The delays of the low layer and of the high one diverge without a step: the second difference of
// a low tone stays within its own bound while its direction changes at each keyframe.
TEST(Binaural, ChangesTheTimeOfLowFrequenciesWithoutAStep) {
  constexpr double kTone_hz = 300, kAmplitude = 0.5;
  const Vec3f places[] = {{1, 0, 0}, {0.7071f, 0.7071f, 0}, {0, 1, 0}, {0, -1, 0}};
  const double bend = std::pow(2 * std::numbers::pi * kTone_hz / kSampleRate_hz, 2);
  for (const int fine : {0, 128}) {
    const auto out = mixed(
        kemar_head(), testing::sine(kTone_hz), 12 * kKeyframeFrames,
        [&](int k) {
          return testing::heard(kemar_head(), places[k % 4], 4000, static_cast<float>(kAmplitude),
                                k == 0);
        },
        with_narrowband_voices_of(fine));
    for (const auto& ear : out)
      for (std::size_t n = kKeyframeFrames; n + 1 < ear.size(); ++n)
        // The near ear is 6 dB louder; the rest of the factor allows for the change of delay.
        ASSERT_LT(std::abs(ear[n + 1] - 2 * ear[n] + ear[n - 1]), 2.5 * kAmplitude * bend)
            << fine << ' ' << n;
  }
}

// Responses that differ by a pure delay have that delay at low and high frequencies and no phase.
TEST(InterauralTimes, AreTheDelayBetweenTwoPulses) {
  const Fourier fourier(kSize);
  for (const double later_s : {-612.4e-6, 3.1e-6, 400e-6}) {
    Spectrum left(kSize), right(kSize);
    for (std::size_t k = 0; k < kSize / 2; ++k) {
      left[k] = 1;
      right[k] =
          std::polar(0.5, -2 * std::numbers::pi * static_cast<double>(k) * kBin_hz * later_s);
    }
    const InterauralTimes times = interaural_times(fourier, kSampleRate_hz, 512, left, right);
    EXPECT_NEAR(times.low_s, later_s, 0.2e-6);
    EXPECT_NEAR(times.high_s, later_s, 0.2e-6);
    for (std::size_t b = 0; b < kPhaseBands; ++b) {
      EXPECT_NEAR(times.phases[b].radians, 0, 2e-3);
      EXPECT_EQ(times.phases[b].is_defined, erb_band_centre_hz(b) >= kSampleRate_hz / 512.0) << b;
    }
  }
}

}  // namespace
}  // namespace clamor
