// octree_traversal.h: walks down the octree of a level, and of its instances, to the nodes that can
// hold a source above a threshold.
//
// A node is culled, with all below it, where
//
//   upper bound of the priorities in it (node_bounds.h) < threshold.
//
// An instance of a tree (instance.h) is traversed in the tree's own space: the listener is moved
// instead of the sources, and the threshold is divided by the gain of the instance. Where only its
// representative can reach the threshold, the instance is not traversed and that source stands for
// it (instance_representatives.h): a billion sources cost what the few thousand instances within
// reach do.
//
// Threads: the sampler's alone.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "formats/bake_file/page_links.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/signal_maps.h"
#include "runtime/query/instance_representatives.h"
#include "runtime/query/node_bounds.h"
#include "runtime/query/validity_region.h"
#include "runtime/streaming/resident_page.h"

namespace clamor {

// Data that all traversals of a level share.
struct QueryContext {
  QueryContext(const RadiationModel& model, const SignalWeights& weights,
               std::span<const PageEntry> tree_tops,
               std::span<const std::vector<std::uint32_t>> signal_maps)
      : radiation(model),
        trees(tree_tops),
        maps(signal_maps),
        bounds(model, weights, tree_tops, signal_maps),
        representatives(model, tree_tops, maps) {}

  const RadiationModel& radiation;
  std::span<const PageEntry> trees;  // the last is the level's
  SignalMaps maps;
  NodeBounds bounds;
  InstanceRepresentatives representatives;
  // Nodes and instances of this keyframe.
  std::uint64_t steps_left = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t work = 0;  // since it was last charged (work_budget.h)
};

class OctreeTraversal {
 public:
  // The space that nodes are in: the level's octree, or an instance of a tree.
  struct Frame {
    const PageEntry* tree = nullptr;  // whose cube the octants divide
    Placement placement;
    Vec3 place{};             // of the listener, in the tree's space
    double to_threshold = 1;  // factor from thresholds of the level to those of the tree
    std::uint32_t map = SignalMaps::kNone;
    bool is_instance = false;
    double error_m = 0;  // rounding of the positions of an instance, in the tree's space
  };
  // `bound` is the upper bound of the priorities in and below the node, in the tree's space. Where
  // the representative of its instance is in or below it, that has `representative_key`.
  struct Node {
    const PageEntry* entry = nullptr;
    std::uint32_t frame = 0;
    std::uint64_t first = 0;  // number of its first source
    double representative_key = 0;
    double bound = 0;
  };
  // An instance of which only the representative can reach the threshold.
  struct DistantInstance {
    const InstanceRepresentative* representative = nullptr;
    Placement placement;
    std::uint32_t signal = 0;
    std::uint64_t first = 0;  // number of its first source
    double representative_key = 0;
    double bound = 0;  // in the level
  };

  explicit OctreeTraversal(QueryContext& context) : context_(&context) {}

  // Starts at the top of the level: nodes are found that reach the region's threshold anywhere in
  // the region. Levels with instances can only be traversed for a radius of 0.
  void start(const ValidityRegion& region);
  // Starts with the top of another tree in the level's space, whatever its bound. Its first source
  // has the number `first`.
  void start(const ValidityRegion& region, const PageEntry& top, std::uint64_t first);
  void reset() {
    region_ = {};
    frames_.clear();
    stack_.clear();
  }
  // Continues below a node that was left out before.
  void resume(const Node& node) { stack_.push_back(node); }

  // Takes the next node, by ascending numbers. False if there is none, or if the keyframe has no
  // steps left: what lies beyond them is ignored.
  bool next(Node& node);
  // Adds the children and the instances of a node whose page is in memory.
  void expand(const Node& node, const ResidentPage& page);

  bool is_done() const { return stack_.empty(); }
  const ValidityRegion& region() const { return region_; }
  // The distant instances of the last expand().
  std::span<const DistantInstance> distant_instances() const { return distant_; }

  // Frames of the nodes so far.
  const Frame& frame(std::uint32_t index) const { return frames_[index]; }
  // Takes the frames of another traversal, for a listener at `place`.
  void take_frames(const OctreeTraversal& other, const Vec3& place);

  // Upper bound of the priority of sources with at most this key, in the frame's space.
  double bound(const NodeSummary& node, const Frame& frame, double key, double radius_m = 0) const {
    return frame.is_instance
               ? context_->bounds.bound_in_instance(node, key, frame.place, frame.placement.scale)
               : context_->bounds.bound(node, key, frame.place, radius_m);
  }

 private:
  void add_children(const Node& from, const ResidentPage& page);
  void add_instances(const Node& from, const ResidentPage& page);
  void add_instance(const Node& from, const Frame& outer, const Instance& instance,
                    const ResidentInstance& resident, double key);

  QueryContext* context_;  // never null; a pointer, so that fronts can be swapped
  ValidityRegion region_;
  std::vector<Frame> frames_;
  std::vector<Node> stack_;
  std::vector<DistantInstance> distant_;
};

}  // namespace clamor
