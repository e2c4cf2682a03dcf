// interaural_times_test.cpp: the time between the ears, band by band, of what the mixer makes for
// the default head against convolution with its measured responses.
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

constexpr double kFollowed_hz = 1400;  // ears hear the wave below, the envelope above

struct Range {
  double low_hz, high_hz;
};
Range erb_band(std::size_t band) {
  const double number = static_cast<double>(band) + 1;
  return {erb_frequency_hz(number), erb_frequency_hz(number + 1)};
}

MixMode with_fine_voices_of(int fine_voices) {
  MixMode mode = kBinaural;
  mode.fine_voices = fine_voices;
  return mode;
}

// What the mixer makes of a click from a measured direction, and what convolution does.
Ears ours(std::size_t direction, const MixMode& mode) {
  const auto out = mixed(
      kemar_head(), click(), 4096,
      [&](int k) {
        return testing::heard(kemar_head(), kemar().directions[direction], 2000, 1, k == 0);
      },
      mode);
  return {spectrum_of(out[0].data(), out[0].size()), spectrum_of(out[1].data(), out[1].size())};
}
Ears direct(std::size_t direction) {
  return {spectrum_of(kemar().response(direction, 0), kemar().frames),
          spectrum_of(kemar().response(direction, 1), kemar().frames)};
}
const double kDirectBin_hz = kemar().rate_hz / kSize;

// How alike both ears are in a range if the right one is heard so much earlier.
std::complex<double> correlation(const Ears& ears, double bin_hz, const Range& range,
                                 double lag_s) {
  const auto first = static_cast<std::size_t>(range.low_hz / bin_hz + 0.5);
  const double angle = -2 * std::numbers::pi * bin_hz * lag_s;
  const std::complex<double> turn = std::polar(1.0, angle);
  std::complex<double> at = std::polar(1.0, angle * static_cast<double>(first)), sum = 0;
  for (std::size_t k = first; static_cast<double>(k) * bin_hz < range.high_hz; ++k, at *= turn)
    sum += ears[0][k] * std::conj(ears[1][k]) * at;
  return sum;
}
double coherence(const Ears& ears, double bin_hz, const Range& range, double lag_s) {
  const auto energy = [&](std::size_t e) {
    return std::abs(correlation({ears[e], ears[e]}, bin_hz, range, 0));
  };
  return std::abs(correlation(ears, bin_hz, range, lag_s)) / std::sqrt(energy(0) * energy(1));
}

// Of what is heard of a range: the lag of the most, or that of the envelope's, not farther than
// `reach_s` from `near_s`.
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

// What no response of the file can tell: bands lower than one period in its length, 86 Hz.
bool is_told(std::size_t band) {
  return erb_band_centre_hz(band) * static_cast<double>(kemar().frames) >= kemar().rate_hz;
}
// Half a period to either side of all bands' time, beyond which another wave would be taken for it.
double reach_s(std::size_t band) { return std::min(0.5 / erb_band_centre_hz(band), 0.5e-3); }

double tolerance_s(double time_s) { return std::max(20e-6, 0.05 * std::abs(time_s)); }

TEST(Binaural, HasTheTimeBetweenTheEarsOfConvolutionInEveryErbBandBelow1400Hz) {
  std::size_t bands = 0;
  for (const std::size_t d : two_hundred()) {
    const Ears made = ours(d, kBinaural), measured = direct(d);
    const double near_s = broad_lag_s(measured, kDirectBin_hz);
    for (std::size_t b = 0; b < kPhaseBands; ++b) {
      if (!is_told(b)) continue;
      const double expected_s = lag_s(measured, kDirectBin_hz, erb_band(b), near_s, reach_s(b));
      // The time is well defined everywhere: both ears are as good as one signal.
      ASSERT_GT(coherence(measured, kDirectBin_hz, erb_band(b), expected_s), 0.8) << b << ' ' << d;
      EXPECT_NEAR(lag_s(made, kBin_hz, erb_band(b), expected_s, reach_s(b)), expected_s,
                  tolerance_s(expected_s))
          << erb_band_centre_hz(b) << " Hz, direction " << d;
      ++bands;
    }
  }
  EXPECT_EQ(bands, 15 * two_hundred().size());  // 105 Hz to 1275 Hz
}

// Of all frequencies above together. Sound comes round the head on more than one way, so that the
// measured time jumps between directions; there, the mixer's is in the middle, or a head that turns
// would be heard to jump.
TEST(Binaural, HasTheTimeBetweenEnvelopesOfConvolutionAbove1400Hz) {
  constexpr Range kAbove{kFollowed_hz, 12000};
  constexpr double kSteepest_s = 25e-6;  // a degree
  std::vector<double> measured_s;
  for (std::size_t d = 0; d < kemar().directions.size(); ++d) {
    const Ears measured = direct(d);
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
    EXPECT_NEAR(lag_s(ours(d, kBinaural), kBin_hz, kAbove, measured_s[d], 0.4e-3), measured_s[d],
                tolerance_s(measured_s[d]))
        << d;
  }
  EXPECT_LE(jumps, two_hundred().size() / 12);
}

// A crowd's voices have two times only, and no phases: the lower one as a whole, and what is left
// band by band, as a share of a period.
TEST(NarrowbandVoices, LeaveTheOthersTwoTimesBetweenTheEars) {
  for (const std::size_t d : two_hundred()) {
    const Ears made = ours(d, with_fine_voices_of(0)), measured = direct(d);
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

// Many voices, each its own sound: powers and cross-spectra add. Just noticeable are 0.075
// (binaural_cues.h).
TEST(NarrowbandVoices, LeaveACrowdAllRoundAsWideAsConvolutionDoes) {
  if (kSanitized) GTEST_SKIP() << "takes 200 directions, of which sanitizers see 40";
  struct Sums {
    std::array<double, kErbBandCount> left{}, right{};
    std::array<std::vector<std::complex<double>>, kErbBandCount> cross;
  } sums[2];
  constexpr int kLags = 100;  // of 10 us to either side
  for (const std::size_t d : two_hundred())
    for (const int mixed_here : {0, 1}) {
      const Ears ears = mixed_here == 0 ? direct(d) : ours(d, with_fine_voices_of(0));
      const double bin_hz = mixed_here == 0 ? kDirectBin_hz : kBin_hz;
      Sums& sum = sums[mixed_here];
      for (std::size_t b = 0; b < kErbBandCount; ++b) {
        const Range range = erb_band(b);
        sum.left[b] += std::abs(correlation({ears[0], ears[0]}, bin_hz, range, 0));
        sum.right[b] += std::abs(correlation({ears[1], ears[1]}, bin_hz, range, 0));
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

// The low layer's delays go apart from the high one's without a step: a low tone bends nowhere more
// than it does itself, however its direction changes from keyframe to keyframe.
TEST(Binaural, SlidesTheTimeOfLowFrequenciesWithoutAStep) {
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
        with_fine_voices_of(fine));
    for (const auto& ear : out)
      for (std::size_t n = kKeyframeFrames; n + 1 < ear.size(); ++n)
        // As loud as 6 dB more at the near ear, and then some for what slides.
        ASSERT_LT(std::abs(ear[n + 1] - 2 * ear[n] + ear[n - 1]), 2.5 * kAmplitude * bend)
            << fine << ' ' << n;
  }
}

// Responses that are nothing but a time apart: all of it in both times, and no phase beside.
TEST(InterauralTimes, AreThoseOfTwoPulses) {
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
      EXPECT_EQ(times.phases[b].told, erb_band_centre_hz(b) >= kSampleRate_hz / 512.0) << b;
    }
  }
}

}  // namespace
}  // namespace clamor
