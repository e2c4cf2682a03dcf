// Late taps that are few and strong sound like a room once they are spread, and echoes stay.
#include "runtime/field/late_density.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"

namespace clamor {
namespace {

struct LateTap {
  double delay_frames;
  float amplitude;
};

// A decay of 60 dB a second from 0.1 to 0.9 s: twenty arrivals a millisecond, of which one in forty
// has a thousand times the power of the others.
std::vector<LateTap> grainy_decay() {
  std::vector<LateTap> taps;
  for (std::uint32_t i = 0; i < 16'000; ++i) {
    const RandomBits bits = philox(1, {i, 0, 0, 0});
    const double delay_s = 0.1 + 0.8 * unit(bits[0]);
    const double power = (i % 40 == 0 ? 1000 : 1) * std::pow(10, -6 * delay_s);
    taps.push_back({delay_s * kSampleRate_hz,
                    static_cast<float>((bits[1] % 2 == 0 ? 1 : -1) * std::sqrt(power))});
  }
  return taps;
}

// The pieces of all taps, as soon as they are known.
std::vector<double> pieces_of(const std::vector<LateTap>& taps) {
  LateDensity density;
  std::vector<double> pieces;
  while (density.lacks_passes() > 0) {
    density.begin();
    pieces.clear();
    for (const LateTap& tap : taps)
      pieces.push_back(
          density.pieces(tap.delay_frames, same_in_all_bands(tap.amplitude * tap.amplitude)));
  }
  return pieces;
}

// The sum of the taps in windows of a third of a millisecond: about the octave at 2 kHz.
std::vector<double> response(const std::vector<LateTap>& taps, const std::vector<double>& pieces) {
  std::vector<double> sum(kSampleRate_hz);
  for (std::uint32_t t = 0; t < taps.size(); ++t)
    for (std::uint32_t k = 0; k < pieces[t]; ++k) {
      const LateDensity::Piece piece = LateDensity::piece(t, k, pieces[t]);
      const auto first = static_cast<std::size_t>(taps[t].delay_frames + piece.shift_frames);
      for (std::size_t f = first; f < first + 16; ++f)
        sum[f] += static_cast<double>(taps[t].amplitude) * static_cast<double>(piece.amplitude);
    }
  return sum;
}

double power_between(const std::vector<double>& samples, double from_s, double to_s) {
  double sum = 0;
  for (auto f = static_cast<std::size_t>(from_s * kSampleRate_hz);
       f < static_cast<std::size_t>(to_s * kSampleRate_hz); ++f)
    sum += samples[f] * samples[f];
  return sum;
}

// Abel and Huang: the share of samples beyond one sigma in 20 ms, over that of noise; the mean.
double echo_density(const std::vector<double>& samples, double from_s, double to_s) {
  constexpr double kWindow_s = 0.02;
  double sum = 0;
  int windows = 0;
  for (double at_s = from_s; at_s + kWindow_s <= to_s; at_s += kWindow_s, ++windows) {
    const double sigma =
        std::sqrt(power_between(samples, at_s, at_s + kWindow_s) / (kWindow_s * kSampleRate_hz));
    const auto first = static_cast<std::size_t>(at_s * kSampleRate_hz);
    for (std::size_t f = first; f < first + static_cast<std::size_t>(kWindow_s * kSampleRate_hz);
         ++f)
      sum += std::abs(samples[f]) > sigma ? 1 : 0;
  }
  return sum / (windows * kWindow_s * kSampleRate_hz * 0.3173);
}

TEST(LateDensity, MakesAGrainyDecayAsDenseAsNoiseAndNoLouder) {
  const std::vector<LateTap> taps = grainy_decay();
  const std::vector<double> pieces = pieces_of(taps);
  const auto before = response(taps, std::vector<double>(taps.size(), 1.0)),
             after = response(taps, pieces);
  EXPECT_LT(echo_density(before, 0.3, 0.8), 0.6);
  EXPECT_NEAR(echo_density(after, 0.3, 0.8), 1, 0.1);
  // Powers add up but for the interference of some thousand pieces.
  for (const double at_s : {0.2, 0.4, 0.6})
    EXPECT_NEAR(10 * std::log10(power_between(after, at_s, at_s + 0.2) /
                                power_between(before, at_s, at_s + 0.2)),
                0, 0.8)
        << at_s;
}

TEST(LateDensity, GivesPiecesThePowerOfTheirTap) {
  for (const double pieces : {1.0, 1.25, 2.0, 7.5, 288.0}) {
    double power = 0;
    for (std::uint32_t k = 0; k < pieces; ++k) {
      const LateDensity::Piece piece = LateDensity::piece(3, k, pieces);
      power += static_cast<double>(piece.amplitude) * static_cast<double>(piece.amplitude);
      EXPECT_LE(std::abs(piece.shift_frames), LateDensity::kWidth_frames / 2);
    }
    EXPECT_NEAR(power, 1, 1e-5) << pieces;
  }
}

TEST(LateDensity, LeavesTheFirstTenthOfASecondAlone) {
  std::vector<LateTap> taps = grainy_decay();
  for (LateTap& tap : taps) tap.delay_frames -= 0.1 * kSampleRate_hz;
  const std::vector<double> pieces = pieces_of(taps);
  for (std::size_t t = 0; t < taps.size(); ++t)
    if (taps[t].delay_frames < LateDensity::kFrom_frames) {
      EXPECT_EQ(pieces[t], 1);
    }
}

// Two walls four metres apart: sound returns every 23 ms, each time from a patch of either wall.
// The slap echo comes from a wall of a square that reverberates faintly.
TEST(LateDensity, LeavesAFlutterAndASlapEchoAlone) {
  const auto echo = [](std::vector<LateTap>& taps, double delay_s, double power) {
    for (std::uint32_t i = 0; i < 20; ++i) {
      const RandomBits bits = philox(2, {i, static_cast<std::uint32_t>(taps.size()), 0, 0});
      taps.push_back({(delay_s + 0.002 * unit(bits[0])) * kSampleRate_hz,
                      static_cast<float>(std::sqrt(power * unit(bits[1])))});
    }
  };
  std::vector<LateTap> flutter, slap;
  for (double delay_s = 0.1; delay_s < 1; delay_s += 0.0233)
    echo(flutter, delay_s, std::pow(10, -3 * delay_s));
  for (std::uint32_t i = 0; i < 800; ++i)
    slap.push_back({unit(philox(3, {i, 0, 0, 0})[0]) * kSampleRate_hz, 0.001f});
  echo(slap, 0.2, 1);
  for (const double pieces : pieces_of(flutter)) EXPECT_EQ(pieces, 1);
  const std::vector<double> of_slap = pieces_of(slap);
  for (const double pieces : std::span(of_slap).last(20)) EXPECT_EQ(pieces, 1);
}

}  // namespace
}  // namespace clamor
