// late_boost.h: a factor that raises the priority of late reflections, so that all windows of an
// impulse response get voices (runtime/README.md, "Visibility and late reflections").
//
//   priority w f / u,   f(t) = 1 + c (exp(r t) - 1) / (r T),   t = min(delay at the source, T),
//
// with T = 0.3 s and f at most 64. A chosen source's power is scaled by max(1, tau / (w f)); f is a
// constant of the source, so the estimate stays unbiased. r is 1.1 times the decay rate 13.8 / T30
// that the bake measured, the mean of 2 to 8 kHz. Without a measured decay, and for sources of
// instanced trees, f is 1. t excludes the path from the source to the listener, so that the
// octree's key bounds times f of a node's latest source stay upper bounds. c is 1/2 k / 2000 up to
// k = 2000 voices and 1/2 2000 / k above, and falls with the square of the number of sources above
// 250 000.
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
