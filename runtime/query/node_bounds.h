// node_bounds.h: upper bounds of the priorities of all sources in a node of the octree.
//
// Let w_b be the highest weight of any signal in band b, D_b the highest density that any material
// or emitter radiates with, m_b the loss of the air per metre. A source with power P = sum_b P_b,
// all of which might be in one band, has at a distance of at least d a priority of at most
//
//   sum_b w_b P_b D_b exp(-m_b d) / d^2 / u  <=  (P / u) h(d) / d^2,   h(d) = max_b w_b D_b
//   exp(-m_b d),
//
// times its late boost. So the bound of a node follows from its highest key, the distance to its
// box and the delay of its latest source; it is 0 where the node's emission cone points away. Far
// away the bound is much lower than without the air: of a city at 3 km the high bands are gone.
//
// Signals raise the bound by what they play while the sound that is heard now was under way, and
// not by what they play earlier or later. Their maxima are taken over a window of about two
// seconds, and anew when the window ends or the listener leaves its neighbourhood.
//
// Threads: the sampler's alone.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "formats/bake_file/page_links.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/query/source_pool.h"

namespace clamor {

// Weights that no instance's sources exceed, whatever signals it plays instead.
SignalWeights max_over_instances(const SignalWeights& weights,
                                 std::span<const std::vector<std::uint32_t>> signal_maps);

// The distance of a place to the box of a node.
inline double distance_m(const NodeSummary& node, const Vec3& place) {
  const Vec3 low(node.low_m), high(node.high_m);
  return length(glm::max(glm::max(low - place, place - high), Vec3(0)));
}

class NodeBounds {
 public:
  // `weights` are those of max_over_instances(). All must outlive the object.
  NodeBounds(const RadiationModel& radiation, const SignalWeights& weights,
             std::span<const PageEntry> trees,
             std::span<const std::vector<std::uint32_t>> signal_maps);

  // Renews the window if it does not reach far enough from the keyframe's place or time.
  void begin(const QueryKeyframe& keyframe);

  // Strength of the late boost; sources of instances have none.
  float late_boost() const { return boost_strength_; }

  // Upper bound of the priority of any source with at most this key in a node or below, within
  // `radius_m` of `place`.
  double bound(const NodeSummary& node, double key, const Vec3& place, double radius_m = 0) const {
    const float boost = radiation_.late_boost().at(node.max_delay_s);
    return key * per_key(node, place, 1, radius_m) *
           (1 + static_cast<double>(boost_strength_ * boost));
  }
  // Lengths are in the space of the node's tree; `to_level` scales its metres to the level's.
  double bound_in_instance(const NodeSummary& node, double key, const Vec3& place,
                           double to_level) const {
    return key * per_key(node, place, to_level, 0);
  }

  // Upper bounds of the weights of a signal, in the window.
  const Bands& max_weights(std::uint32_t signal) const { return max_weights_[signal]; }
  // In the window no signal is louder than this share of its maximum.
  double max_share() const { return max_share_; }
  double until_s() const { return until_s_; }

 private:
  static constexpr std::size_t kDistances = 8 * 24;  // eight per octave, from 1/16 m on

  void tabulate(std::span<const Bands> weights);
  double per_key(const NodeSummary& node, const Vec3& place, double to_level,
                 double radius_m) const;

  const RadiationModel& radiation_;
  const SignalWeights& weights_;
  const std::span<const PageEntry> trees_;
  const std::span<const std::vector<std::uint32_t>> signal_maps_;
  std::vector<Bands> max_weights_;
  std::array<double, kDistances> at_distance_{};  // h(d)
  Vec3 centre_{};                                 // of the window's neighbourhood
  double from_s_ = 0, until_s_ = -1, max_share_ = 1;
  float boost_strength_ = 1;
};

}  // namespace clamor
