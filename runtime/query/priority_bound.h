// priority_bound.h: how loud a source can be at most that is known by its key and a box alone.
//
// Let w_b be the most that any signal weighs in band b, D_b the highest density any material or
// emitter radiates with, m_b the loss of the air. A source with power P = sum_b P_b, all of which
// might be in one band, has at a distance of at least d a priority of at most
//
//   sum_b w_b P_b D_b exp(-m_b d) / d^2 / u  <=  (P / u) most(d) / d^2,
//   most(d) = max_b w_b D_b exp(-m_b d),
//
// which falls with d, and is looked up at the next shorter of eight distances per octave. Far away
// it is much less than without the air: of a city at 3 km the high bands are gone.
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

  // Most that a priority is of a source whose key is 1, in the node or below it, heard at `place`.
  // Both are in the space of a copied tree: `to_level` makes its metres the level's. 0 where the
  // node's emission cone points away.
  //  `give_m`: wherever within so many metres of it.
  double per_key(const NodeSummary& node, const Vec3& place, double to_level,
                 double give_m = 0) const;

 private:
  static constexpr int kLeastOctave = -4, kOctaves = 24;

  // Floats of equal exponent and three leading bits of mantissa share a place.
  static std::uint32_t place_of(float distance_m) {
    return std::bit_cast<std::uint32_t>(distance_m) >> 20;
  }
  static constexpr std::uint32_t kFirst = static_cast<std::uint32_t>(127 + kLeastOctave) << 3;

  double most_at(double distance_m) const {
    const std::uint32_t place = std::max(place_of(static_cast<float>(distance_m)), kFirst) - kFirst;
    return most_[std::min<std::size_t>(place, most_.size() - 1)];
  }

  std::array<double, static_cast<std::size_t>(8 * kOctaves)> most_{};
};

}  // namespace clamor
