// moving_field.h: a free field with moving sources, and its output.
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "common/air.h"
#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/level/signal.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/voices/keyframe.h"
#include "tools/strategies/strategies.h"

namespace clamor::testing {

inline Vec3 place_in_room(std::uint32_t i, std::uint32_t step) {
  const RandomBits bits = philox(8, {i, step, 0, 0});
  return {6 * unit(bits[0]), 8 * unit(bits[1]), 3 * unit(bits[2])};
}

// Propagation delay from a source that moves in a straight line and is at `position_m` now: R = c
// delay was its distance R / c ago, which gives a quadratic equation.
inline double delay_of_moving_s(const Vec3& position_m, const Vec3& velocity_mps,
                                const Vec3& place) {
  const double c = speed_of_sound_mps(Air{});
  const Vec3 offset_m = place - position_m, mach = velocity_mps / c;
  const double ahead_m = dot(offset_m, mach), rest = 1 - dot(mach, mach);
  return (ahead_m + std::sqrt(ahead_m * ahead_m + rest * dot(offset_m, offset_m))) / rest / c;
}

// A free field without static sources.
inline std::unique_ptr<Auralizer> empty_field(std::vector<Signal> signals, std::size_t most,
                                              const std::string& strategy = "priority",
                                              int voices = 100) {
  AuralizerInput input;
  AuralizerOptions options;
  options.strategy = make_strategy(strategy);
  options.voices = voices;
  options.moving.max_sources = most;
  for (std::uint32_t s = 0; s < signals.size(); ++s)
    options.moving.kinds.push_back({signals[s].name, s, {}});
  options.moving.signals = std::move(signals);
  auto made = Auralizer::create(std::move(input), options);
  EXPECT_TRUE(made.ok()) << made.error().message;
  return std::move(*made);
}

// The left ear of a listener at the origin; before_keyframe(time_s) moves sources.
template <class Before>
std::vector<float> heard(Auralizer& auralizer, double seconds, Before before_keyframe) {
  std::vector<float> left, block(2 * kKeyframeFrames);
  while (static_cast<double>(left.size()) < seconds * kSampleRate_hz) {
    while (auralizer.wants_keyframe()) {
      before_keyframe(auralizer.next_keyframe_time_s());
      auralizer.make_keyframe({});
    }
    auralizer.mix(block);
    for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
  }
  return left;
}

}  // namespace clamor::testing
