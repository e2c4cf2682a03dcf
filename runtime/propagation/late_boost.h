// late_boost.h: how much likelier than by their weight late reflections are chosen.
//
// Chosen by weight alone, the k sources fall to each moment of an impulse response in proportion to
// its energy: 300 ms after the direct sound, 35 dB down, to a step of 5 ms falls not even one of
// 2000, and its energy is wrong by 10 dB. With n of them in a step its error is 4.34 / sqrt(n) dB
// at most, so steps are alike sure where all get as many, and the whole is surest where each gets
// its share of the energy. This is a mixture of both (a defensive mixture: T. Hesterberg. Weighted
// average importance sampling and defensive mixture distributions. Technometrics 37(2), 1995), over
// the first T = 0.3 s:
//
//   priority w f / u,   f(t) = 1 + c (exp(r t) - 1) / (r T),   t = min(travelled so far, T),
//
// f at most 64. A chosen source's power is scaled by max(1, tau / (w f)): f is a constant of the
// source, so that is as unbiased as without, and the choice changes no more when one walks. r is a
// tenth more than the decay that the bake measured, 13.8 / T30, the mean of 2 to 8 kHz, where most
// of an impulse is: the last steps, which have the least, count as much as all others. Without a
// decay f is 1. t counts up to the source, not to the listener: a bound of the octree's keys times
// f of a node's latest source stays a bound. Sources of copied trees have none.
//
// c = 1/2 k / 2000 up to k = 2000: fewer voices cannot make 60 steps sure, and are all needed for
// the loudness. Above, 1/2 2000 / k: that is voices enough, the others bring down the whole's
// error.
//
// Violin room, k = 2000, the error of 60 steps of 5 ms against all sources (root of the mean square
// over steps, four places and eight drawings; an empty step counts as 20 dB), and the deviation of
// the loudness at 20 places:
//
//   sources    steps, Phong 20     steps, Phong 100    loudness, Phong 20
//    50 000    7.2 -> 0.67 dB      4.9 -> 0.27 dB
//   200 000    8.4 -> 0.92         6.2 -> 0.47         0.058 -> 0.078 dB
//
// By counting: with n equal voices in each of 60 steps, out of far more, 1 dB takes n = 19 and so
// 1130 of 2000; what is above tau, and not sampled, brings the error below that. Loudness is 4.34 /
// sqrt(k - 1) = 0.097 dB off at most if all k are for it. With c = 1 (50 000: 0.64 dB, 200 000:
// 0.85) loudness was 0.084 dB off, and at one of 20 places beyond 0.2 dB in 8 of 100 drawings.
//
// Costs: bounds of nodes are looser, so more of them are looked at. A sample of a walk, k = 2000,
// Phong 20, in the same run: 1.1 -> 2.3 ms of 200 000 sources, 3.2 -> 6.6 ms of a million (1306 ->
// 2745 of 2763 pages); the stadium's 36 416 sources 0.56 -> 0.56 ms.
//
// Above 250 000 sources c therefore falls with the square of their number: of a million it is 1/16
// of that, and choosing costs about what it costs without. The default bake has 200 000.
//
// Immutable once made.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace clamor {

struct DecaySummary;

class LateBoost {
 public:
  static constexpr double kUntil_s = 0.3;
  static constexpr double kMost = 64;  // of f

  LateBoost() = default;  // none: f is 1
  // Of a room whose energy falls by 60 dB in so long; none if that is 0. `share` is of c.
  explicit LateBoost(double t60_s, double share = 1);
  // Of a bake with so many sources.
  LateBoost(const DecaySummary& decay, std::uint64_t sources);

  // f - 1 of a source with this delay, at full strength. Never falls with the delay.
  float at(float delay_s) const {
    constexpr auto kLast = static_cast<float>(kUntil_s) * kStepsPerS;
    return boost_[static_cast<std::size_t>(std::clamp(delay_s * kStepsPerS, 0.0f, kLast))];
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
