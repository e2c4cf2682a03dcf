// two_rooms.h: a baked level of two rooms with a wall between them, and received power in it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/bake.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/sampling/sampler.h"
#include "tests/rooms.h"

namespace clamor::testing {

inline constexpr double kSpeed_mps = 343.2;

// Two rooms of 5 x 4 x 3 m side by side. The wall between them is 10 cm thick and has, if asked
// for, a door of 1 x 2 m. The emitter is in the first room.
inline Level two_rooms(bool door) {
  Level level = shoebox({10.1, 4, 3}, uniform_material(0.3f), {1.5, 2, 1.5});
  Mesh& mesh = level.mesh;
  const auto quad = [&mesh](const Vec3f& a, const Vec3f& b, const Vec3f& c, const Vec3f& d) {
    add_quad(mesh, {a, b, c, d});
  };
  const float y0 = door ? 1.5f : 4, y1 = door ? 2.5f : 4, z1 = door ? 2 : 3;
  for (const float x : {5.0f, 5.1f}) {
    quad({x, 0, 0}, {x, y0, 0}, {x, y0, 3}, {x, 0, 3});
    if (!door) continue;
    quad({x, y1, 0}, {x, 4, 0}, {x, 4, 3}, {x, y1, 3});
    quad({x, y0, z1}, {x, y1, z1}, {x, y1, 3}, {x, y0, 3});
  }
  if (door) {
    quad({5, y0, 0}, {5.1f, y0, 0}, {5.1f, y0, z1}, {5, y0, z1});
    quad({5, y1, 0}, {5.1f, y1, 0}, {5.1f, y1, z1}, {5, y1, z1});
    quad({5, y0, z1}, {5.1f, y0, z1}, {5.1f, y1, z1}, {5, y1, z1});
  }
  return level;
}

struct World {
  World(const Level& level, std::uint64_t photons)
      : contents(baked(level, photons)),
        sources(contents.octree.sources),
        radiation(contents.emitters, contents.materials, contents.settings.air),
        surfaces(contents.mesh, contents.materials) {
    weights.by_signal.assign(contents.signals.size(), {1, 2, 3, 4, 5, 4, 3, 2});
  }
  static BakeContents baked(const Level& level, std::uint64_t photons) {
    BakeOptions options;
    options.settings.photons = photons;
    options.threads = 1;
    return *bake(level, options);
  }

  BakeContents contents;
  const std::vector<Source>& sources;
  RadiationModel radiation;
  OcclusionGeometry surfaces;
  SignalWeights weights;
};

// Power per band at a place from the sources of a sample.
inline std::array<double, kBandCount> heard(const World& world,
                                            std::span<const SampledSource> sample,
                                            const Vec3& place) {
  std::array<double, kBandCount> power{};
  for (const SampledSource& one : sample) {
    const Bands intensity = world.radiation.intensity(*one.source, place);
    const Bands gain = power_gain(one.factors);
    for (std::size_t b = 0; b < kBandCount; ++b)
      power[b] += one.power_scale * static_cast<double>(intensity[b]) * gain[b];
  }
  return power;
}

}  // namespace clamor::testing
