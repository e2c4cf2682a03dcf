// instance.h: a copy of a tree of sources, standing elsewhere.
//
// A stand of fans is stored once and repeated: each copy is moved, turned, perhaps made smaller,
// starts later, and plays other signals. Copies of copies go to any depth.
//
// So that copies do not all choose the same of their sources, a tree is stored in a few variants
// that differ in u alone, and each copy has a permanent random number of its own. Let P be the
// power of the tree, and let exactly one of its sources, its representative, have a key P_i / u_i
// above P (representative.h draws it, with probability P_i / P). In a copy with number v the
// representative stands at u_i' = v P_i / P instead: still uniform, as u_i was uniform below P_i /
// P. Its key is P / v then, the highest of the copy; and far from all copies the choice among them
// is that of single sources with powers P and numbers v.
#pragma once

#include <cstdint>
#include <span>

#include "common/vec.h"
#include "formats/bake_file/source.h"

namespace clamor {

inline constexpr std::uint32_t kSameSignals = 0xffffffff;

struct Instance {
  std::uint32_t tree = 0;  // which of the bake's trees
  Vec3 offset_m{};
  Rotation rotation{1, 0, 0, 0};         // unit; w, x, y, z
  float scale = 1;                       // in (0, 1]: of positions, patches and paths
  float gain = 1;                        // of amplitude
  float delay_s = 0;                     // later by so much
  float number = 1;                      // its permanent random number, in (0, 1]
  std::uint32_t signals = kSameSignals;  // which of the bake's signal maps
  std::uint32_t emitters = 0;            // its emitters are so many further on in the table
};

// Where a copy is, seen from the level: instances within instances, multiplied out.
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

  // The source as the level has it.
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
