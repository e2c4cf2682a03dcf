// rooms.h: small rooms built in code.
#pragma once

#include <array>
#include <numbers>

#include "common/sample_rate.h"
#include "formats/level/level.h"
#include "tests/box_mesh.h"

namespace clamor::testing {

// A planar face with these corners in order: two triangles.
inline void add_quad(Mesh& mesh, const std::array<Vec3f, 4>& corners_m,
                     std::uint16_t material = 0) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.insert(mesh.vertices_m.end(), corners_m.begin(), corners_m.end());
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
  mesh.materials.insert(mesh.materials.end(), 2, material);
}

// A wall across a box of `size_m` at x = `x_m`, from floor to ceiling.
inline void add_wall_across(Mesh& mesh, double x_m, const Vec3& size_m, std::uint16_t material) {
  add_quad(mesh,
           {Vec3f(x_m, 0, 0), Vec3f(x_m, size_m.y, 0), Vec3f(x_m, size_m.y, size_m.z),
            Vec3f(x_m, 0, size_m.z)},
           material);
}

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
