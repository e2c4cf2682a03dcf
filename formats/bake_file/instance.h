// instance.h: an instance of a tree of sources.
//
// A stand of fans is stored once and instanced: each instance is translated, rotated, perhaps
// scaled down, delayed, and plays other signals. Instances nest to any depth.
//
// To decorrelate the sampling of instances, a tree is stored in a few variants that differ in u
// alone, and each instance has a permanent random number u of its own. Let P be the power of the
// tree, and let exactly one of its sources, the representative, have a key P_i / u_i above P (the
// bake draws it with probability P_i / P). In an instance the representative has u_i' = u P_i / P
// instead. That is still uniform, because u_i was uniform below P_i / P, and its key P / u is the
// highest of the instance. Far from all instances, sampling them is sampling single sources with
// powers P and these u.
#pragma once

#include <cstdint>
#include <span>

#include "common/vec.h"
#include "formats/bake_file/source.h"

namespace clamor {

inline constexpr std::uint32_t kSameSignals = 0xffffffff;

struct Instance {
  std::uint32_t tree = 0;  // index of a tree of the bake
  Vec3 offset_m{};
  Rotation rotation{1, 0, 0, 0};         // unit; w, x, y, z
  float scale = 1;                       // of positions, patches and paths; in (0, 1]
  float gain = 1;                        // amplitude
  float delay_s = 0;                     // additional delay
  float u = 1;                           // permanent random number, in (0, 1]
  std::uint32_t signals = kSameSignals;  // index of a signal map
  std::uint32_t emitters = 0;            // offset of its emitters in the table
};

// Composed transform of nested instances, relative to the level.
struct Placement {
  Matrix rotation{1};
  Vec3 offset_m{};
  double scale = 1, power = 1, delay_s = 0;
  std::uint32_t emitters = 0;

  Placement then(const Instance& inner) const {
    const Matrix turn = glm::mat3_cast(glm::dquat(inner.rotation));
    return {rotation * turn,         offset_m + scale * (rotation * inner.offset_m),
            scale * inner.scale,     power * inner.gain * inner.gain,
            delay_s + inner.delay_s, emitters + inner.emitters};
  }

  Vec3 inside(const Vec3& place_m) const {
    return glm::transpose(rotation) * (place_m - offset_m) / scale;
  }
  Vec3 outside(const Vec3& place_m) const { return offset_m + scale * (rotation * place_m); }

  float delayed_s(float of_source) const { return static_cast<float>(scale * of_source + delay_s); }

  // Transforms a source to the level.
  Source place(const Source& source) const {
    Source placed = source;
    placed.position_m = Vec3f(outside(Vec3(source.position_m)));
    placed.normal = Vec3f(rotation * Vec3(source.normal));
    placed.mirror = Vec3f(rotation * Vec3(source.mirror));
    placed.delay_s = delayed_s(source.delay_s);
    placed.patch_radius_m = static_cast<float>(scale * source.patch_radius_m);
    for (float& band : placed.power) band = static_cast<float>(power * band);
    placed.emitter += emitters;
    return placed;
  }
};

}  // namespace clamor
