// node_bounds.h: upper bounds of the priorities of all sources in a node of the octree.
//
//   bound = highest key x upper bound of the priority per key at the distance (priority_bound.h)
//           x (1 + late boost of the latest source)
//
// Signals raise the bound by what they play while the sound that is heard now was under way, and
// not by what they play earlier or later. Their maxima are taken over a window of about two
// seconds, and anew when the window ends or the listener leaves its neighbourhood.
//
// Threads: the sampler's alone.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "formats/bake_file/page_links.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/query/priority_bound.h"

namespace clamor {

// Weights that no instance's sources exceed, whatever signals it plays instead.
SignalWeights max_over_instances(const SignalWeights& weights,
                                 std::span<const std::vector<std::uint32_t>> signal_maps);

class NodeBounds {
 public:
  // `weights` are those of max_over_instances(). All must outlive the object.
  NodeBounds(const RadiationModel& field, const SignalWeights& weights,
             std::span<const PageEntry> trees,
             std::span<const std::vector<std::uint32_t>> signal_maps);

  // Renews the window if it does not reach far enough from `place` or `time_s`.
  void begin(const Vec3& place, double time_s);

  // Strength of the late boost, 0 to 1; sources of instances have none.
  void set_late_boost(float strength) { boost_strength_ = strength; }
  float late_boost() const { return boost_strength_; }

  // Upper bound of the priority of any source with at most this key in a node or below, within
  // `radius_m` of `place`. `to_level` scales the metres of the node's tree to the level's.
  double bound(const NodeSummary& node, double key, const Vec3& place, double radius_m = 0) const {
    return key * priority_bound_.per_key(node, place, 1, radius_m) * max_boost(node);
  }
  double bound_in_instance(const NodeSummary& node, double key, const Vec3& place,
                           double to_level) const {
    return key * priority_bound_.per_key(node, place, to_level);
  }

  // Upper bounds of the weights of a signal, in the window.
  const Bands& max_weights(std::uint32_t signal) const { return max_weights_[signal]; }
  // In the window no signal is louder than this share of its maximum.
  double max_share() const { return max_share_; }
  double until_s() const { return until_s_; }

 private:
  double max_boost(const NodeSummary& node) const {
    return 1 + static_cast<double>(boost_strength_ * field_.late_boost().at(node.max_delay_s));
  }

  const RadiationModel& field_;
  const SignalWeights& weights_;
  const std::span<const PageEntry> trees_;
  const std::span<const std::vector<std::uint32_t>> signal_maps_;
  std::vector<Bands> max_weights_;
  PriorityBound priority_bound_;
  Vec3 centre_{};  // of the window's neighbourhood
  double from_s_ = 0, until_s_ = -1, max_share_ = 1;
  float boost_strength_ = 1;
};

}  // namespace clamor
