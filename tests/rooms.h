// rooms.h: small rooms built in code.
#pragma once

#include <numbers>

#include "common/sample_rate.h"
#include "formats/level/level.h"
#include "tests/box_mesh.h"

namespace clamor::testing {

// Half a second of a steady sine of amplitude 0.5.
inline Signal sine(double frequency_hz = 1000) {
  Signal signal;
  signal.name = "sine";
  for (int i = 0; i < kSampleRate_hz / 2; ++i)
    signal.samples.push_back(static_cast<float>(
        0.5 * std::sin(2 * std::numbers::pi * frequency_hz * i / kSampleRate_hz)));
  return signal;
}

// A closed shoebox of one material with one omnidirectional emitter.
inline Level shoebox(const Vec3& size_m, const Material& material, const Vec3& emitter_m) {
  Level level;
  level.name = "shoebox";
  level.mesh = box(size_m);
  level.materials = {material};
  level.signals = {sine()};
  Emitter emitter;
  emitter.name = "source";
  emitter.position_m = emitter_m;
  level.emitters = {emitter};
  return level;
}

}  // namespace clamor::testing
