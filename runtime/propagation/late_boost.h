// late_boost.h: a factor that raises the priority of late reflections.
//
// Sampled by weight alone, the k voices fall to each time of an impulse response in proportion to
// its energy. At 300 ms, 35 dB below the direct sound, a window of 5 ms gets less than one voice of
// 2000, and its energy errs by 10 dB. A window with n voices errs by at most 4.34 / sqrt(n) dB:
// equal counts make all windows equally accurate, while counts in proportion to energy make the
// total most accurate. This factor mixes both distributions over the first T = 0.3 s (a defensive
// mixture: T. Hesterberg. Weighted average importance sampling and defensive mixture distributions.
// Technometrics 37(2), 1995):
//
//   priority w f / u,   f(t) = 1 + c (exp(r t) - 1) / (r T),   t = min(delay at the source, T),
//
// with f at most 64. A chosen source's power is scaled by max(1, tau / (w f)). f is a constant of
// the source, so the estimate stays unbiased, and the sample changes no more as the listener walks.
// r is 1.1 times the decay rate 13.8 / T30 that the bake measured, the mean of 2 to 8 kHz, where
// most of an impulse's energy is; the last windows, which get the fewest voices, then get as many
// as all others. Without a measured decay f is 1. t excludes the path from the source to the
// listener, so that the octree's key bounds times f of a node's latest source stay upper bounds.
// Sources of instanced trees have f = 1.
//
// c is 1/2 k / 2000 up to k = 2000: fewer voices cannot make 60 windows accurate, and all of them
// are needed for the loudness. Above that c is 1/2 2000 / k: the windows have voices enough, and
// further ones reduce the error of the total.
//
// Violin room, k = 2000. Steps: RMS error of 60 windows of 5 ms against all sources, over windows,
// four places and eight samples (an empty window counts as 20 dB). Loudness: standard deviation at
// 20 places.
//
//   sources    steps, Phong 20     steps, Phong 100    loudness, Phong 20
//    50 000    7.2 -> 0.67 dB      4.9 -> 0.27 dB
//   200 000    8.4 -> 0.92         6.2 -> 0.47         0.058 -> 0.078 dB
//
// In theory, an error of 1 dB in each of 60 windows takes 19 equal voices each, 1130 of 2000;
// sources above tau, which are not sampled, reduce it further. Loudness errs by at most
// 4.34 / sqrt(k - 1) = 0.097 dB if all k voices serve it. With c = 1 (50 000: 0.64 dB, 200 000:
// 0.85) loudness erred by 0.084 dB, and by more than 0.2 dB at one of 20 places in 8 of 100
// samples.
//
// Cost: upper bounds of nodes are looser, so more nodes are visited. Sampling on a walk, k = 2000,
// Phong 20, took 1.1 -> 2.3 ms with 200 000 sources, 3.2 -> 6.6 ms with a million (1306 -> 2745 of
// 2763 pages), and 0.56 -> 0.56 ms with the stadium's 36 416 sources.
//
// Above 250 000 sources c therefore falls with the square of their number: for a million it is 1/16
// of the above, and sampling costs about as much as without. The default bake has 200 000 sources.
//
// Immutable.
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
  static constexpr double kMaxBoost = 64;

  LateBoost() = default;  // f is 1
  // For a room with this decay time (0: f is 1). `share` scales c.
  explicit LateBoost(double t60_s, double share = 1);
  // For a bake with so many sources.
  LateBoost(const DecaySummary& decay, std::uint64_t sources);

  // f - 1 for a source with this delay, at full strength. Increases with the delay.
  float at(float delay_s) const {
    constexpr auto kLast = static_cast<float>(kUntil_s) * kStepsPerS;
    return boost_[static_cast<std::size_t>(std::clamp(delay_s * kStepsPerS, 0.0f, kLast))];
  }

  // The factor of f - 1 for a sample of so many voices.
  static float strength(std::size_t voices) {
    const float share = static_cast<float>(voices) / kFullVoices;
    return share > 1 ? 1 / share : share;
  }

 private:
  static constexpr float kStepsPerS = 1000, kFullVoices = 2000;
  std::array<float, 301> boost_{};
};

}  // namespace clamor
