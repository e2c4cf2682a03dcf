// priority_bound.h: upper bound of a priority from a node's bounds and highest key.
//
// Let w_b be the highest weight of any signal in band b, D_b the highest density that any material
// or emitter radiates with, m_b the loss of the air per metre. A source with power P = sum_b P_b,
// all of which might be in one band, has at a distance of at least d a priority of at most
//
//   sum_b w_b P_b D_b exp(-m_b d) / d^2 / u  <=  (P / u) h(d) / d^2,
//   h(d) = max_b w_b D_b exp(-m_b d).
//
// h falls with d and is tabulated at eight distances per octave. Far away the bound is much lower
// than without the air: of a city at 3 km the high bands are gone.
//
// Immutable once made.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/source_octree.h"
#include "runtime/propagation/radiation_model.h"

namespace clamor {

class PriorityBound {
 public:
  // `weights` are per signal, of every signal that may be played.
  PriorityBound(const RadiationModel& field, std::span<const Bands> weights);

  // Upper bound of the priority per key of sources in the node or below, heard within `radius_m` of
  // `place`. Lengths are in the space of the node's tree; `to_level` scales its metres to the
  // level's. 0 where the emission cone of the node points away.
  double per_key(const NodeSummary& node, const Vec3& place, double to_level,
                 double radius_m = 0) const;

 private:
  static constexpr int kMinOctave = -4, kOctaves = 24;

  // Floats of equal exponent and three leading bits of mantissa share an entry.
  static std::uint32_t entry_of(float distance_m) {
    return std::bit_cast<std::uint32_t>(distance_m) >> 20;
  }
  static constexpr std::uint32_t kFirst = static_cast<std::uint32_t>(127 + kMinOctave) << 3;

  double at_distance(double distance_m) const {
    const std::uint32_t entry = std::max(entry_of(static_cast<float>(distance_m)), kFirst) - kFirst;
    return at_distance_[std::min<std::size_t>(entry, at_distance_.size() - 1)];
  }

  std::array<double, static_cast<std::size_t>(8 * kOctaves)> at_distance_{};
};

}  // namespace clamor
