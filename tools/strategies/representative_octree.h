// representative_octree.h: an octree in which one source of each node represents all of them (the
// paper, section 3.5).
//
// The bounding cube is divided until each node holds one source. From the leaves up, one of the
// representatives of the (up to eight) children is drawn for the parent with a probability in
// proportion to the children's volumes, and the parent's volume is their sum. Source i thus
// represents a node with probability volume_i / volume_node, with the factor volume_node /
// volume_i.
//
// A cut through the tree is a sample. It starts at the root, and the most important node is
// replaced by its children until there are k nodes: a priority queue, O(k log k) for any n.
//
// Correction: the paper computes a node's importance at the position of its representative and
// claims in a footnote that this is unbiased because representatives were drawn before. It is not.
// A node represented by a near source is opened, and all of it is heard; one represented by a far
// source stays closed, and the far source is heard for both, so far sources are too loud. Here a
// node's importance is its volume over the square of the distance to its bounds (over the distance,
// if volumes are amplitudes), which does not depend on the drawing, times the receivers'
// directivity towards the middle of the bounds (none for a node around the listener).
//
// As in the paper, directions of emission do not influence the choice; octree-diffusion adds them.
// This tree is the reference; the tree that plays is in formats/bake_file.
//
// Immutable. Memory: about 100 bytes per source.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/vec.h"
#include "runtime/propagation/reception.h"

namespace clamor {

class RepresentativeOctree {
 public:
  struct Point {
    Vec3 position_m{};
    double volume = 0;    // at 1 m; zero is never heard
    double radius_m = 0;  // within it nothing grows louder
  };

  // Source `point` represents a node, with its volume scaled by `factor`.
  struct Representative {
    std::uint32_t point = 0;
    double factor = 1;
  };

  // Volumes fall with the distance to the power of `fall`: 2 for powers, 1 for amplitudes.
  RepresentativeOctree(std::span<const Point> points, double fall, std::uint64_t seed);

  // The cut with k nodes, or up to 6 fewer if opening one more would exceed k; sorted by point. All
  // points if there are at most k.
  std::vector<Representative> cut(const Vec3& place, std::size_t k,
                                  const Reception& reception = Reception()) const;

 private:
  friend class SlowCut;  // in its test

  struct Node {
    Vec3f low_m{}, high_m{};
    float radius_m = 0;  // the smallest of its points
    std::uint32_t point = 0;
    double volume = 0;
    std::uint32_t first_child = 0, children = 0;  // contiguous; none: a leaf
  };

  void build(std::uint32_t node, std::span<std::uint32_t> points, const Vec3& centre_m,
             double half_m, int depth);
  void represent(std::uint32_t node, std::uint64_t seed);
  double importance(const Node& node, const Vec3& place, const Reception& reception) const;

  std::span<const Point> points_;  // during construction
  double fall_;
  std::vector<double> volumes_;  // of points
  std::vector<Node> nodes_;      // children after parents, the root first
};

}  // namespace clamor
