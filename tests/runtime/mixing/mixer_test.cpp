#include "runtime/mixing/mixer.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "tests/rooms.h"
#include "tests/runtime/mixer_voices.h"

namespace clamor {
namespace {

using testing::voice;

// Samples at the left ear of `steps` steps; next(k) returns keyframe k.
template <class Next>
std::vector<float> mixed_steps(const std::vector<PreparedSignal>& signals, int steps, Next next,
                               std::int64_t clock = 0, const MixMode& mode = {}) {
  Mixer mixer(signals, 8, mode);
  std::uint64_t number = 0;
  mixer.begin(next(number++), clock);
  std::vector<float> out, block(2 * kStepFrames);
  for (int s = 0; s < steps; ++s) {
    if (mixer.wants_keyframe()) mixer.load(next(number++));
    mixer.step(block.data());
    for (int f = 0; f < kStepFrames; ++f) out.push_back(block[static_cast<std::size_t>(2 * f)]);
  }
  return out;
}

TEST(Mixer, KeepsItsPhaseForADay) {
  const auto signals = prepare_signals(std::vector<Signal>{testing::sine(997)});
  const auto still = [](std::uint64_t number) {
    Keyframe keyframe;
    keyframe.voices = {voice(0, 1234.56789, 0.7f)};
    keyframe.voices[0].starts = number == 0;
    return keyframe;
  };
  const std::int64_t day = std::int64_t{24} * 3600 * kSampleRate_hz;  // a whole number of loops
  EXPECT_EQ(mixed_steps(signals, 200, still), mixed_steps(signals, 200, still, day));
}

TEST(Mixer, ShiftsTheFrequencyOfAPassingSourceByTheDopplerFormula) {
  constexpr double kTone_hz = 1000, kSpeed_mps = 30, kSound_mps = 343.2;
  struct Case {
    double nearest_m;
    bool eight_bands;  // the bank delays changes at 1 kHz by 2.4 ms, which is 0.13 % at 5 m
  };
  for (const auto [nearest_m, eight_bands] : {Case{5, false}, Case{20, false}, Case{8, true}}) {
    const MixMode mode{Interpolation::kCubic, 2, eight_bands};
    const auto signals = prepare_signals(std::vector<Signal>{testing::sine(kTone_hz)}, mode);
    const auto delay_s = [near_m = nearest_m](double t) {
      return std::hypot(near_m, kSpeed_mps * (t - 1)) / kSound_mps;
    };
    const auto passing = [&](std::uint64_t number) {
      Keyframe keyframe;
      const double t = static_cast<double>(number) * kKeyframeFrames / kSampleRate_hz;
      keyframe.voices = {voice(0, delay_s(t) * kSampleRate_hz, 0.5f)};
      keyframe.voices[0].starts = number == 0;
      return keyframe;
    };
    const auto out = mixed_steps(signals, 2 * kSampleRate_hz / kStepFrames, passing, 0, mode);
    // Phase difference between output and expected signal in a window of six periods.
    const auto wrong_phase = [&](std::size_t first) {
      std::complex<double> heard = 0, meant = 0;
      for (std::size_t n = first; n < first + 288; ++n) {
        const double t = static_cast<double>(n) / kSampleRate_hz;
        const double window = std::sin(std::numbers::pi * static_cast<double>(n - first) / 288);
        const auto back =
            std::polar(window * window, -2 * std::numbers::pi * kTone_hz * (t - delay_s(t)));
        heard += static_cast<double>(out[n]) * back;
        meant += std::sin(2 * std::numbers::pi * kTone_hz * (t - delay_s(t))) * back;
      }
      return std::arg(heard / meant);
    };
    // Compares every 3 ms, after the two keyframes in which the voice starts.
    double worst_hz = 0;
    for (std::size_t n = 3 * kKeyframeFrames; n + 432 < out.size(); n += 144) {
      const double turned =
          std::remainder(wrong_phase(n + 144) - wrong_phase(n), 2 * std::numbers::pi);
      worst_hz =
          std::max(worst_hz, std::abs(turned) / (2 * std::numbers::pi) * kSampleRate_hz / 144);
    }
    EXPECT_LT(worst_hz, 0.001 * kTone_hz) << nearest_m << " m";
  }
}

TEST(Mixer, InterpolatesGainsAndDelaysBetweenKeyframesWithoutSteps) {
  // A constant signal shows the gains; a ramp, interpolated linearly, shows the read position.
  std::vector<Signal> sounds(2);
  sounds[0].samples = {1};
  for (int i = 0; i < 20000; ++i) sounds[1].samples.push_back(static_cast<float>(i) / 16384);
  sounds[1].loop = false;
  const MixMode mode{Interpolation::kLinear, 2, false};
  const auto signals = prepare_signals(sounds, mode);
  for (const std::uint32_t sound : {0u, 1u}) {
    std::vector<double> gains, delays;  // of the keyframes
    const auto moving = [&](std::uint64_t number) {
      const double turn = 0.7 * static_cast<double>(number);
      gains.push_back(sound == 0 ? std::sin(turn) : 1);
      delays.push_back(100 * std::sin(turn));
      Keyframe keyframe;
      keyframe.voices = {voice(0, delays.back(), static_cast<float>(gains.back()))};
      keyframe.voices[0].signal = sound;
      keyframe.voices[0].starts = number == 0;
      return keyframe;
    };
    const auto out = mixed_steps(signals, 12 * kKeyframeFrames / kStepFrames, moving, 2000, mode);
    const auto at = [&](std::size_t n) {
      return sound == 0 ? static_cast<double>(out[n]) : static_cast<double>(out[n]) * 16384;
    };
    for (std::size_t k = 1; k < 12; ++k) {
      const std::size_t n = k * kKeyframeFrames;
      if (sound == 0) {
        EXPECT_NEAR(at(n), gains[k], 2e-6) << k;
        EXPECT_LE(std::abs(at(n) - at(n - 1)), std::abs(gains[k] - gains[k - 1]) / 960 + 1e-6) << k;
      } else {
        EXPECT_NEAR(at(n), 2000 + static_cast<double>(n) - delays[k], 2e-3)
            << k;  // 24 bits of 8192
        // The step of the read speed at a keyframe is no larger than its change in between: a
        // hundred frames per radian and keyframe squared.
        const double before = at(n) - at(n - 32), after = at(n + 32) - at(n);
        if (k > 2) {
          EXPECT_NEAR(after, before, 32 * 2.5 * 100 * 0.49 / 15 / 960)
              << k << ", " << after - before;
        }
      }
    }
  }
}

// Keyframes of one voice that does not move.
auto standing(double delay_frames, const Bands& gains = same_in_all_bands(1)) {
  return [=](std::uint64_t number) {
    Keyframe keyframe;
    keyframe.voices = {voice(0, delay_frames, 0)};
    keyframe.voices[0].gain = {gains, gains};
    keyframe.voices[0].starts = number == 0;
    return keyframe;
  };
}

// Largest error of a tone that is read with a delay of `fraction` frames, relative to its
// amplitude.
double tone_error(double frequency_hz, double fraction, const MixMode& mode) {
  const auto signals = prepare_signals(std::vector<Signal>{testing::sine(frequency_hz)}, mode);
  const auto out = mixed_steps(signals, 30, standing(100 + fraction), 0, mode);
  double worst = 0;
  for (std::size_t n = 0; n < out.size(); ++n) {
    const double turn = frequency_hz * (static_cast<double>(n) - 100 - fraction) / kSampleRate_hz;
    const double expected = 0.5 * std::sin(2 * std::numbers::pi * turn);
    worst = std::max(worst, std::abs(static_cast<double>(out[n]) - expected));
  }
  return worst / 0.5;
}

// Error of linear interpolation (order 2) or a cubic spline (order 4) of a tone of `f` periods per
// sample.
double curve_error(double f, double x, int order) {
  const auto tone = [&](double k) { return std::polar(1.0, 2 * std::numbers::pi * f * k); };
  if (order == 2) return std::abs((1 - x) * tone(0) + x * tone(1) - tone(x));
  const double y = 1 - x, knots = 4 + 2 * std::cos(2 * std::numbers::pi * f);
  return std::abs((y * y * y * tone(-1) + (4 - 6 * x * x + 3 * x * x * x) * tone(0) +
                   (4 - 6 * y * y + 3 * y * y * y) * tone(1) + x * x * x * tone(2)) /
                      knots -
                  tone(x));
}

TEST(Mixer, InterpolatesWithTheErrorOfACubicSpline) {
  const MixMode linear{Interpolation::kLinear, 2, false}, cubic{Interpolation::kCubic, 2, false};
  const double rounding = 1e-5;  // -100 dB
  for (const double hz : {100.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0, 12000.0, 16000.0})
    for (const double fraction : {0.125, 0.25, 0.5, 0.75}) {
      const double f = hz / kSampleRate_hz;
      EXPECT_LT(tone_error(hz, fraction, linear), curve_error(f, fraction, 2) + rounding) << hz;
      EXPECT_LT(tone_error(hz, fraction, cubic), curve_error(f, fraction, 4) + rounding) << hz;
    }
  // With eight bands the low layer has a quarter of the sample rate, and the filter bank may add an
  // error of -80 dB.
  for (const double hz : {100.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0, 16000.0}) {
    const double f = hz / kSampleRate_hz;
    EXPECT_LT(tone_error(hz, 0.5, {}),
              curve_error(hz < 1414 ? kLowRate * f : f, 0.5, 4) * (hz < 1414 ? 1.1 : 1) + 1e-4)
        << hz;
  }
  // A delay of whole frames needs no interpolation.
  for (const double hz : {100.0, 1000.0, 16000.0}) EXPECT_LT(tone_error(hz, 0, cubic), 1e-6) << hz;
}

TEST(Mixer, GivesEachBandItsGainWithinHalfADecibel) {
  Signal impulse;
  impulse.samples = {1};
  impulse.loop = false;
  const auto signals = prepare_signals(std::vector<Signal>{impulse});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int shape = 0; shape < 24; ++shape) {
    // Reflections keep 1 to 90 % of the power of a band, with at most 10 dB between neighbours, and
    // up to 150 m of air lose 6 dB more per octave (ISO 9613-1: 0.1 dB per metre at 8 kHz).
    Bands gains{};
    double level_db = 0;
    const double air_m = shape % 3 == 0 ? 0 : 150 * unit(random);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      level_db = std::clamp(level_db + 20 * (unit(random) - 0.5), -30.0, 0.0);
      const double octaves_below = static_cast<double>(kBandCount - 1 - b);
      const double air_db = 0.1 * air_m * std::pow(0.3, octaves_below);
      gains[b] = static_cast<float>(std::pow(10, (level_db - air_db) / 20));
    }
    constexpr int kZero = 4800;
    const auto out = mixed_steps(signals, 20000 / kStepFrames, standing(kZero, gains));
    for (std::size_t b = 0; b < kBandCount; ++b) {
      std::complex<double> sum = 0;
      for (std::size_t n = 0; n < out.size(); ++n)
        sum += static_cast<double>(out[n]) *
               std::polar(1.0, -2 * std::numbers::pi * kBandCentres_hz[b] *
                                   (static_cast<double>(n) - kZero) / kSampleRate_hz);
      EXPECT_NEAR(20 * std::log10(std::abs(sum) / static_cast<double>(gains[b])), 0, 0.5)
          << shape << ", " << kBandCentres_hz[b] << " Hz";
    }
  }
}

TEST(Mixer, PlaysSilenceForSamplesThatAreNotNumbersAndCountsThem) {
  Signal broken = testing::sine(440), mended = broken;
  for (const std::size_t i : {7u, 100u, 23999u}) {
    broken.samples[i] =
        i == 7 ? std::numeric_limits<float>::infinity() : std::numeric_limits<float>::quiet_NaN();
    mended.samples[i] = 0;
  }
  const auto signals = prepare_signals(std::vector<Signal>{broken});
  EXPECT_EQ(signals[0].bad_samples(), 3u);
  EXPECT_EQ(mixed_steps(signals, 60, standing(10)),
            mixed_steps(prepare_signals(std::vector<Signal>{mended}), 60, standing(10)));
}

TEST(Mixer, PlaysAOneShotOnceAtItsTime) {
  const auto signals = prepare_signals(std::vector<Signal>{{"click", {1, 0.5f}, false}});
  // Also where the clock has run for weeks.
  for (const double clock_frames : {0.0, 4e9, 2.7e11}) {
    const auto still = [clock_frames](std::uint64_t number) {
      Keyframe keyframe;
      keyframe.voices = {voice(0, clock_frames + 2000, 1)};
      keyframe.voices[0].starts = number == 0;
      return keyframe;
    };
    const auto out = mixed_steps(signals, 200, still, static_cast<std::int64_t>(clock_frames));
    for (std::size_t n = 0; n < out.size(); ++n)
      ASSERT_NEAR(out[n], n == 2000 ? 1 : n == 2001 ? 0.5 : 0, 1e-4) << n;
  }
}

}  // namespace
}  // namespace clamor
