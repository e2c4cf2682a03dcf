#include "runtime/field/sparse_response.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "common/crossover.h"
#include "common/sample_rate.h"
#include "runtime/field/field_kernel.h"
#include "runtime/hrtf/hrtf_filters.h"
#include "runtime/voices/mix_kernel.h"
#include "runtime/voices/octave_filter_bank.h"
#include "tests/runtime/instruction_sets.h"

namespace clamor {
namespace {

using Complex = std::complex<double>;

// Numbers in half precision, as a FieldSpectrum has them, times their scale.
std::vector<float> unpacked(std::span<const std::uint16_t> halves, float scale) {
  std::vector<float> numbers;
  for (const std::uint16_t half : halves) {
    const int exponent = half >> 10 & 31, fraction = half & 1023;
    const float size = exponent == 0
                           ? std::ldexp(static_cast<float>(fraction), -24)
                           : std::ldexp(static_cast<float>(1024 + fraction), exponent - 25);
    numbers.push_back(half >> 15 == 0 ? size * scale : -size * scale);
  }
  return numbers;
}

// A spectrum of a layer at a frequency, for both ears.
std::array<Complex, kEars> ears_at(std::span<const float> spectrum, const LaneFourier& fourier,
                                   std::size_t bin) {
  const std::size_t size = fourier.size();
  std::array<Complex, 2> at;
  for (std::size_t i = 0; i < size; ++i)
    for (const std::size_t mirrored : {0u, 1u})
      if (fourier.bin(i) == (mirrored == 1 ? (size - bin) % size : bin))
        at[mirrored] =
            Complex(static_cast<double>(spectrum[i]), static_cast<double>(spectrum[size + i])) *
            static_cast<double>(size);
  return {(at[0] + std::conj(at[1])) / 2.0, (at[0] - std::conj(at[1])) / Complex(0, 2)};
}

// What a filter bank passes of each octave's gain at a frequency.
std::array<double, kBandCount> passed_at(double frequency_hz, bool is_head) {
  const auto& buses = is_head ? HrtfFilters::bus_gains() : OctaveFilterBank::bus_gains();
  std::array<double, kBandCount> passed{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    double by_bus = is_head ? 0 : OctaveFilterBank::magnitude(b, frequency_hz);
    const bool is_low = b < kLowBands;
    for (std::size_t j = is_low ? 0 : kHrtfLowBands;
         is_head && j < (is_low ? kHrtfLowBands : kHrtfBands); ++j)
      by_bus += static_cast<double>(HrtfFilters::octave_share(b, j)) *
                HrtfFilters::magnitude(j, frequency_hz);
    for (std::size_t c = 0; c < kBandCount; ++c) passed[c] += buses[b][c] * by_bus;
  }
  return passed;
}

// Oracle: each tap is a delay, and the octave filters' magnitudes in closed form.
class SparseResponseOf : public ::testing::TestWithParam<bool> {};

TEST_P(SparseResponseOf, TapsEqualsTheirSumThroughTheFilterBank) {
  const bool is_head = GetParam();
  constexpr std::size_t kTaps = 300, kPartition = 7;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::array<std::array<Bands, kTaps>, kEars> gains;
  std::array<std::vector<Tap>, kEars> taps;
  std::array<std::vector<double>, kEars> delays_frames;
  for (std::size_t e = 0; e < kEars; ++e)
    for (std::size_t i = 0; i < kTaps; ++i) {
      // Away from the ends, so that all of a spline is in the partition.
      const double after = 8 + uniform(random) * (kHighField.partition - 16.0);
      const double delay = kPartition * kHighField.partition + after, low = delay / kLowRate;
      Tap& tap = taps[e].emplace_back();
      tap.high = static_cast<std::int32_t>(delay);
      tap.high_fraction = static_cast<float>(delay - tap.high);
      tap.low = static_cast<std::int32_t>(low + 0.5);
      tap.low_fraction = static_cast<float>(low - tap.low);
      for (float& band : gains[e][i]) band = static_cast<float>(uniform(random) - 0.3);
      tap.gain = &gains[e][i];
      tap.amplitude = 0.5f;
      delays_frames[e].push_back(after);
    }
  SparseResponse response{MixMode{.head = is_head}};
  response.reserve(kPartition + 3);
  for (std::size_t e = 0; e < kEars; ++e) response.add(e, taps[e]);
  FieldSpectrum spectrum;
  std::vector<std::size_t> partitions;
  response.transform([&](std::size_t partition) -> FieldSpectrum& {
    partitions.push_back(partition);
    return spectrum;
  });
  ASSERT_EQ(partitions, std::vector<std::size_t>{kPartition});

  const LaneFourier high(kHighField.transform, kHighFieldLanes),
      low(kLowField.transform, kLowFieldLanes);
  const auto high_numbers = unpacked(spectrum.high, spectrum.high_scale),
             low_numbers = unpacked(spectrum.low, spectrum.low_scale);
  double worst = 0;
  for (std::size_t bin = 3; bin < 300; bin += 3) {
    const double frequency_hz = static_cast<double>(bin) * kSampleRate_hz / kHighField.transform;
    const double w = 2 * std::numbers::pi * frequency_hz / kSampleRate_hz;
    const auto passed = passed_at(frequency_hz, is_head);
    const auto split = [&](Side side) {
      return crossover_magnitude(kLowBands - 1, kSampleRate_hz, side, frequency_hz);
    };
    const auto heard_high = ears_at(high_numbers, high, bin);
    // The low layer has frequencies up to 6 kHz, and nothing of its signal above 3 kHz.
    const auto heard_low = ears_at(low_numbers, low, std::min<std::size_t>(2 * bin, 511));
    // Spline coefficients of the high layer are halved, and their spline is the mixer's.
    const double spline = (2 + std::cos(w)) / 3;
    for (std::size_t e = 0; e < kEars; ++e) {
      Complex expected = 0;
      double scale = 0;
      for (std::size_t i = 0; i < kTaps; ++i) {
        double gain = 0;
        for (std::size_t c = 0; c < kBandCount; ++c)
          gain += passed[c] * 0.5 * static_cast<double>(gains[e][i][c]);
        expected += std::polar(gain, -w * delays_frames[e][i]);
        scale += gain * gain;
      }
      const auto after_margin = [&](const FieldLayer& layer, double rate) {
        return std::polar(1.0, w * static_cast<double>(layer.margin) * rate);
      };
      const Complex heard =
          split(Side::kHigh) * heard_high[e] * after_margin(kHighField, 1) / spline / 2.0 +
          split(Side::kLow) * heard_low[e] * after_margin(kLowField, kLowRate);
      worst = std::max(worst, std::abs(heard - expected) / std::sqrt(scale));
    }
  }
  EXPECT_LT(worst, 0.005);
}
INSTANTIATE_TEST_SUITE_P(Banks, SparseResponseOf, ::testing::Bool());

// Loud or quiet, also where low frequencies are 100 dB above high ones, and alike by each
// instruction set: what Highway cuts on some and rounds on others is rounded before.
TEST(FieldSpectrum, IsKeptWithin66DbBelowEachOfItsNumbers) {
  const testing::KernelGuard guard;
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (const float loudest : {1e-9f, 1.0f, 1e9f}) {
    FieldSums sums{};
    for (std::size_t i = 0; i < sums.high.size(); ++i)
      sums.high[i] = loudest * uniform(random) * (i % 2 == 0 ? 1 : 1e-5f);
    std::vector<float> first;
    for (const std::string& target : mix_kernel_targets()) {
      force_mix_kernel(target);
      FieldSpectrum spectrum;
      pack(sums, spectrum);
      const auto kept = unpacked(spectrum.high, spectrum.high_scale);
      // Half of the last of 11 bits, and the rounding of the scale.
      for (std::size_t i = 0; i < kept.size(); ++i)
        ASSERT_NEAR(kept[i], sums.high[i], 0.00049f * std::abs(sums.high[i]) + 1e-9f * loudest)
            << i;
      for (const float silent : unpacked(spectrum.low, spectrum.low_scale)) ASSERT_EQ(silent, 0);
      if (first.empty()) first = kept;
      // The smallest step of all is -228 dB.
      for (std::size_t i = 0; i < kept.size(); ++i)
        ASSERT_NEAR(kept[i], first[i], 4e-12f * loudest) << target;
    }
  }
}

}  // namespace
}  // namespace clamor
