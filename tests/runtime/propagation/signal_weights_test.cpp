#include "runtime/propagation/signal_weights.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "common/crossover.h"
#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/level/signal.h"
#include "runtime/propagation/loudness.h"
#include "runtime/voices/octave_filter_bank.h"

namespace clamor {
namespace {

Signal noise_bursts(bool loop, double silent_s, double burst_s, double total_s) {
  Signal signal{"bursts", {}, loop};
  for (std::uint32_t i = 0; i < total_s * kSampleRate_hz; ++i) {
    const double t = std::fmod(static_cast<double>(i) / kSampleRate_hz, silent_s + burst_s);
    const double x = unit(philox(5, {i, 0, 0, 0})[0]) - 0.5;
    signal.samples.push_back(t < silent_s ? 0.0f : static_cast<float>(x));
  }
  return signal;
}

TimedEnvelope timed(const Signal& signal) {
  return {SignalEnvelope(signal), signal.samples.size(), signal.loop};
}

LoudnessTrack track(const TimedEnvelope& timed, const EnvelopeSmoothing& smoothing = {}) {
  return {timed.envelope, timed.frames, timed.loop, same_in_all_bands(1), smoothing};
}
LoudnessTrack track(const Signal& signal, const EnvelopeSmoothing& smoothing = {}) {
  return track(timed(signal), smoothing);
}

double sum(const Bands& bands) {
  double sum = 0;
  for (const float band : bands) sum += band;
  return sum;
}

// Compared with the mixer's filter bank, an independent implementation at two sample rates.
TEST(SignalWeights, AreTheMeanSquareOfTheMixersBandsOverALoop_NoAsan) {
  std::vector<Signal> signals = {noise_bursts(true, 0.3, 0.2, 2.0), noise_bursts(true, 0, 1, 0.9),
                                 noise_bursts(true, 0.7, 0.05, 5.1)};
  for (const double hz : {63.0, 130.0, 400.0, 1000.0, 5000.0}) {
    Signal& tone = signals.emplace_back();
    for (int i = 0; i < kSampleRate_hz; ++i)
      tone.samples.push_back(
          static_cast<float>(0.3 * std::sin(2 * 3.14159265358979 * hz * i / kSampleRate_hz)));
  }
  for (const Signal& signal : signals) {
    const LoudnessTrack raw = track(signal, {0, 0, 0});
    const auto moments = static_cast<int>(moments_of(signal.samples.size()));
    const double moment_s = static_cast<double>(signal.samples.size()) / kSampleRate_hz / moments;
    std::array<double, kBandCount> mean{};
    for (int m = 0; m < moments; ++m)
      for (std::size_t b = 0; b < kBandCount; ++b)
        mean[b] += raw.at((m + 0.5) * moment_s).weights[b] / moments;
    const std::vector<double> samples(signal.samples.begin(), signal.samples.end());
    const Bands mixed = OctaveFilterBank::part(samples, true).mean_square;
    // The mixer filters low bands at a quarter of the sample rate, which changes the skirts 36 dB
    // down.
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (mixed[b] > 1e-3 * sum(mixed)) {
        EXPECT_NEAR(10 * std::log10(mean[b] / mixed[b]), 0, 0.1) << b;
      }
  }
}

TEST(SignalWeights, AreAtLeastTheMeanOverTheDecayOfARoomAndNeverZeroDuringASound_NoAsan) {
  for (const bool loop : {false, true}) {
    const TimedEnvelope bursts = timed(noise_bursts(loop, 1.7, 0.1, 3.6));
    const LoudnessTrack raw = track(bursts, {0, 0, 0}), smooth = track(bursts);
    for (double t = -3.99; t < 6; t += 0.02) {
      // A triangular window of 0.7 s.
      double mean = 0;
      for (int i = -18; i <= 18; ++i)
        mean += (1 - std::abs(i) / 19.0) / 19 * sum(raw.at(t + 0.02 * i).weights);
      if (sum(raw.at(t).weights) > 0) {
        EXPECT_GE(sum(smooth.at(t).weights), 0.999 * mean) << t;
        for (std::size_t b = 0; b < kBandCount; ++b) EXPECT_GT(smooth.at(t).weights[b], 0) << t;
      }
      for (std::size_t b = 0; b < kBandCount; ++b)
        EXPECT_LE(smooth.at(t).weights[b], smooth.max()[b]) << t;
    }
  }
}

// Follows the mean only. Without this smoothing every phrase would exchange voices.
constexpr EnvelopeSmoothing kWithoutBursts{.burst_db = 100};

TEST(SignalWeights, AreAtLeastTheLoudestMoment_NoAsan) {
  Signal claps{"claps", std::vector<float>(4 * kSampleRate_hz, 0.001f), true};
  for (std::size_t clap = 0; clap < 8; ++clap)
    for (std::size_t i = 0; i < 480; ++i)
      claps.samples[clap * kSampleRate_hz / 2 + i] = i % 2 == 0 ? 0.9f : -0.9f;
  const TimedEnvelope envelope = timed(claps);
  const LoudnessTrack heard = track(envelope), moments = track(envelope, {0, 0, 0});
  for (double t = 0; t < 4; t += 0.02)
    EXPECT_GE(sum(heard.at(t).weights), 0.999 * sum(moments.at(t).weights)) << t;
  const LoudnessTrack mean = track(envelope, kWithoutBursts);
  EXPECT_LT(sum(mean.at(1.01).weights), 0.2 * sum(moments.at(1.01).weights));
}

TEST(SignalWeights, AreConstantThroughoutAPhrase_NoAsan) {
  for (const bool loop : {false, true}) {
    Signal phrase{"phrase", {}, loop};
    for (std::uint32_t i = 0; i < 8 * kSampleRate_hz; ++i) {
      const double t = static_cast<double>(i) / kSampleRate_hz;
      const double swell = 0.3 + 0.7 * std::sin(3.14159265358979 * t / 8);
      const double note = std::exp(-5 * std::fmod(t, 0.5));
      const double hz = std::fmod(t, 1.0) < 0.5 ? 300 : 1500;
      phrase.samples.push_back(
          static_cast<float>(swell * note * std::sin(2 * 3.14159265358979 * hz * t)));
    }
    const LoudnessTrack heard = track(phrase, kWithoutBursts);
    // A one-shot is followed up to its maximum and held there.
    for (double t = loop ? 0 : 4.5; t < 8; t += 0.02)
      EXPECT_EQ(heard.at(t).weights, heard.max()) << t;
  }
}

TEST(SignalWeights, FollowALoudSoundAndDecayAfterIt_NoAsan) {
  Signal signal{"bang", {}, true};
  for (std::uint32_t i = 0; i < 20 * kSampleRate_hz; ++i) {
    const double x = unit(philox(5, {i, 0, 0, 0})[0]) - 0.5;
    const double t = static_cast<double>(i) / kSampleRate_hz;
    signal.samples.push_back(static_cast<float>((t >= 5 && t < 6 ? 1 : 0.01) * x));
  }
  const LoudnessTrack heard = track(signal, kWithoutBursts);
  const double bang = sum(heard.at(5.5).weights);
  EXPECT_EQ(sum(heard.at(7.5).weights), bang);
  // 40 dB exceed the hysteresis of 12 dB.
  for (const double t : {4.0, 9.0, 15.0})
    EXPECT_NEAR(10 * std::log10(sum(heard.at(t).weights) / bang), -28, 0.5) << t;
}

TEST(SignalWeights, KnowASoundInAdvanceAndEndSoonAfterIt_NoAsan) {
  Signal signal{"burst", std::vector<float>(5 * kSampleRate_hz, 0), false};
  for (std::size_t i = 2 * kSampleRate_hz; i < 3 * kSampleRate_hz; ++i)
    signal.samples[i] = i % 2 == 0 ? 0.5f : -0.4f;
  for (const bool loop : {false, true}) {
    signal.loop = loop;
    const LoudnessTrack heard = track(signal);
    EXPECT_EQ(sum(heard.at(1.7).weights), 0);
    EXPECT_GT(sum(heard.at(1.92).weights), 0.5 * sum(heard.at(2.5).weights));
    EXPECT_EQ(sum(heard.at(3.5).weights), sum(heard.at(2.5).weights));
    EXPECT_EQ(sum(heard.at(3.8).weights), 0);
    // A loop repeats; a one-shot is silent before and after.
    EXPECT_EQ(sum(heard.at(7.5).weights) > 0, loop);
    EXPECT_EQ(sum(heard.at(-2.5).weights) > 0, loop);
    EXPECT_EQ(heard.at(2.5 + 5e5).weights == heard.at(2.5).weights, loop);
  }
}

TEST(SignalWeights, BetweenTwoTimesAreTheMaximumOverThem_NoAsan) {
  for (const bool loop : {false, true}) {
    const LoudnessTrack heard = track(noise_bursts(loop, 0.37, 0.06, 2.9));
    for (std::uint32_t i = 0; i < 300; ++i) {
      const RandomBits bits = philox(9, {i, 0, 0, 0});
      const double from_s = 12 * unit(bits[0]) - 5, to_s = from_s + 4 * unit(bits[1]);
      Bands slow{};
      for (double t = from_s; t < to_s; t += 0.005)
        for (std::size_t b = 0; b < kBandCount; ++b)
          slow[b] = std::max(slow[b], heard.at(t).weights[b]);
      for (std::size_t b = 0; b < kBandCount; ++b)
        slow[b] = std::max(slow[b], heard.at(to_s).weights[b]);
      EXPECT_EQ(heard.max_between(from_s, to_s), slow) << from_s << " " << to_s;
    }
  }
}

TEST(SignalWeights, OfALoopHaveNoSeam_NoAsan) {
  const Signal signal = noise_bursts(true, 0.33, 0.17, 2.5);
  Signal later = signal;  // the same loop, starting 1 s later
  std::rotate(later.samples.begin(), later.samples.begin() + kSampleRate_hz, later.samples.end());
  const LoudnessTrack heard = track(signal), moved = track(later);
  for (double t = 0; t < 5; t += 0.013)
    EXPECT_NEAR(10 * std::log10(sum(moved.at(t).weights) / sum(heard.at(t + 1).weights)), 0, 0.5)
        << t;
}

TEST(SignalWeights, OfSteadySoundsAreSteady_NoAsan) {
  Signal tone{"tone", {}, true};
  for (int i = 0; i < kSampleRate_hz / 2; ++i)
    tone.samples.push_back(static_cast<float>(std::sin(2 * 3.14159265358979 * i / 48)));
  const std::vector<TimedEnvelope> steady = {timed(tone)};
  EXPECT_TRUE(make_signal_weights(steady).steady());
  const std::vector<TimedEnvelope> both = {timed(tone), timed(noise_bursts(true, 1.4, 0.1, 3))};
  const SignalWeights weights = make_signal_weights(both);
  EXPECT_FALSE(weights.steady());
  EXPECT_EQ(weights.tracks[0].at(12.3).weights, weights.by_signal[0]);
  // Closed form: what both edges of the band pass of a sine at its centre.
  const double passed = crossover_magnitude(3, kSampleRate_hz, Side::kHigh, 1000) *
                        crossover_magnitude(4, kSampleRate_hz, Side::kLow, 1000);
  EXPECT_NEAR(weights.by_signal[0][4] / (0.5 * passed * passed * loudness_weights()[4]), 1, 0.001);
}

TEST(SignalWeights, OfAnEmptySignalAreZero_NoAsan) {
  for (const bool loop : {false, true})
    EXPECT_EQ(track({"nothing", {}, loop}).at(0.1).weights, Bands{});
}

}  // namespace
}  // namespace clamor
