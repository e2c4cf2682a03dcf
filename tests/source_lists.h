// source_lists.h: lists of sources for tests of octrees, ordinary and pathological.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/random.h"
#include "formats/bake_file/source.h"

namespace clamor::testing {

// A random place on a wall of a 20 x 8 x 15 m hall, and a direction about its normal.
struct WallPoint {
  Vec3 position_m, normal, mirror;
};
inline WallPoint wall_point(std::uint32_t face, const RandomBits& a, const RandomBits& b) {
  const int axis = static_cast<int>(face / 2);
  Vec3 place(unit(a[0]), unit(a[1]), unit(b[2])), normal(0);
  place[axis] = face % 2;
  normal[axis] = face % 2 == 0 ? 1 : -1;
  const double cos_i = std::sqrt(unit_above_zero(a[2])), turn = 2 * std::numbers::pi * unit(a[3]);
  Vec3 mirror = normal * cos_i;
  mirror[(axis + 1) % 3] = std::sqrt(1 - cos_i * cos_i) * std::cos(turn);
  mirror[(axis + 2) % 3] = std::sqrt(1 - cos_i * cos_i) * std::sin(turn);
  return {place * Vec3(20, 8, 15), normal, mirror};
}

// Sources on the walls of that hall, with powers spread over 60 dB.
inline std::vector<Source> wall_sources(std::uint32_t count, std::uint64_t seed = 2) {
  std::vector<Source> sources(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const RandomBits a = philox(seed, {i, 0, 0, 0}), b = philox(seed, {i, 1, 0, 0});
    const WallPoint point = wall_point(i % 6, a, b);
    Source& source = sources[i];
    source.position_m = Vec3f(point.position_m);
    source.normal = Vec3f(point.normal);
    source.mirror = Vec3f(point.mirror);
    source.delay_s = static_cast<float>(0.02 + 1.5 * unit(b[0]));
    source.power = same_in_all_bands(static_cast<float>(std::pow(10, -6 * unit(b[0]))));
    source.patch_radius_m = 0.3f;
    source.u = static_cast<float>(unit_above_zero(b[1]));
  }
  return sources;
}

// Properties that make a list difficult.
struct DegenerateList {
  std::uint32_t keys = 0;      // number of different keys; 0: all differ
  std::uint32_t places = 0;    // number of different places; 0: all differ
  double spread_m = 0;         // extent of all places; 0: that of the hall
  double far_m = 0;            // distance of the first source
  std::uint32_t emitters = 0;  // the first `emitters` sources are omnidirectional
};

inline std::vector<Source> degenerate_sources(std::uint32_t count, std::uint64_t seed,
                                              const DegenerateList& list) {
  std::vector<Source> sources = wall_sources(count, seed);
  for (std::uint32_t i = 0; i < count; ++i) {
    Source& source = sources[i];
    const RandomBits bits = philox(seed, {i, 2, 0, 0});
    if (list.keys > 0) {
      // zero included
      source.power = same_in_all_bands(static_cast<float>(bits[0] % list.keys));
      source.u = 1;
    }
    if (list.places > 0)
      source.position_m = sources[bits[1] % std::min(list.places, count)].position_m;
    if (list.spread_m > 0)
      source.position_m = Vec3f(1, 2, 3) + source.position_m * static_cast<float>(list.spread_m);
    if (i == 0) source.position_m.x += static_cast<float>(list.far_m);
    source.is_emitter = i < list.emitters;
  }
  return sources;
}

}  // namespace clamor::testing
