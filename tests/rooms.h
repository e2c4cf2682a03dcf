// rooms.h: small rooms built in code.
#pragma once

#include <cstddef>
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

// A room with a hole in a wall and two materials, whose bands absorb differently.
inline Level open_room() {
  Material hard = uniform_material(0.1f, 0.3f, 20), soft = hard;
  hard.absorption = {0.1f, 0.1f, 0.15f, 0.2f, 0.2f, 0.1f, 0.1f, 0.3f};
  soft.name = "soft";
  soft.absorption = {0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.5f, 0.6f, 0.6f};
  soft.scattering = uniform_material(0, 0.6f).scattering;
  Level level = shoebox({5, 4, 3}, hard, {1.3, 1.7, 1.1});
  level.materials.push_back(soft);
  level.mesh = box({5, 4, 3}, {0, 1, 0, 0, 0, 0});
  level.mesh.triangles.erase(level.mesh.triangles.begin());
  level.mesh.materials.erase(level.mesh.materials.begin());
  return level;
}

inline Level with_absorption(Level level, std::size_t material, float absorption) {
  level.materials[material].absorption = same_in_all_bands(absorption);
  return level;
}

}  // namespace clamor::testing
