// late_boost.h: how much likelier than by their weight late reflections are chosen.
//
// Chosen by weight alone, the k sources fall to each moment of an impulse response in proportion to
// its energy: 300 ms after the direct sound, 35 dB down, to a step of 5 ms falls not even one of
// 2000, and its energy is wrong by 10 dB. With n of them in a step its error is 4.34 / sqrt(n) dB
// at most (less where few are left out), so steps are alike sure where all get as many; the whole
// is surest where each gets its share of the energy. This is a mixture of both (a defensive
// mixture: T. Hesterberg. Weighted average importance sampling and defensive mixture distributions.
// Technometrics 37(2), 1995), for a decay exp(-r t) over the first T = 0.3 s:
//
//   priority w f / u,   f(t) = 1 + c (exp(r t) - 1) / (r T),   t = min(travelled so far, T),
//
// f at most 64. A chosen source's power is scaled by max(1, tau / (w f)): f is a constant of the
// source, so that is as unbiased as without, and the choice changes no more when one walks. r is
// from the decay that the bake measured, 13.8 / T30, the mean of 2 to 8 kHz, where most of an
// impulse is; without one f is 1. t counts up to the source, not to the listener: a bound of the
// octree's keys times f of a node's latest source stays a bound. Sources of copied trees have none.
//
// c = k / 2000 up to k = 2000: fewer voices cannot make 60 steps sure, and are all needed for the
// loudness. Above c = 2000 / k: that is voices enough, and the others bring down the whole's error.
//
// Violin room, k = 2000, the error of 60 steps of 5 ms against all sources (root of the mean
// square, an empty step being 20 dB; late_boost_test.cpp), the deviation of the loudness, and what
// a sample of a walk takes, in the same run:
//
//   sources    Phong 20         Phong 100        loudness, Phong 20    a sample, Phong 20
//    50 000    7.5 -> 0.6 dB    4.8 -> 0.3 dB    0.04 -> 0.05 dB
//   200 000    8.3 -> 0.9       6.4 -> 0.5       0.04 -> 0.07          0.9 -> 1.7 ms
// 1 000 000    9.1 -> 1.1       8.1 -> 0.8       0.07 -> 0.10          2.0 -> 5.1 ms
//
// (4.34 / sqrt(k - 1) dB of loudness is 0.097.) The time is for bounds that are looser by the
// latest source's f, and so for pages: of 1 000 000 sources nearly all 2763 instead of 1306.
//
// Immutable once made.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace clamor {

struct DecaySummary;

class LateBoost {
 public:
  static constexpr double kUntil_s = 0.3;
  static constexpr double kMost = 64;  // of f

  LateBoost() = default;  // none: f is 1
  // Of a room whose energy falls by 60 dB in so long; none if that is 0.
  explicit LateBoost(double t60_s);
  // Of a bake.
  explicit LateBoost(const DecaySummary& decay);

  // f - 1 of a source with this delay, at full strength. Never falls with the delay.
  float at(float delay_s) const {
    return boost_[std::min(static_cast<std::size_t>(std::max(delay_s, 0.0f) * kStepsPerS),
                           boost_.size() - 1)];
  }

  // The share of it that is taken when k sources are chosen.
  static float strength(std::size_t voices) {
    const float share = static_cast<float>(voices) / kFullVoices;
    return share > 1 ? 1 / share : share;
  }

 private:
  static constexpr float kStepsPerS = 1000, kFullVoices = 2000;
  std::array<float, 301> boost_{};
};

}  // namespace clamor
