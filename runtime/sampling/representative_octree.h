// representative_octree.h: an octree in which each node has one of its sources stand for all.
//
// (The paper, section 3.5.) The bounding cube is divided until each node holds one source. Then,
// from the leaves up, one of the (up to eight) children's representatives is drawn for the parent,
// with a probability in proportion to the children's volumes, and the parent's volume is their sum.
// So source i represents a node with probability volume_i / volume_node, and stands there for the
// whole of it with the factor volume_node / volume_i.
//
// A cut through the tree is a sample. It starts at the root, and the most important node gives way
// to its children until there are k: a priority queue, O(k log k) whatever n is.
//
// Corrected: the paper takes a node's importance at the place of its representative, and says in a
// footnote that the choice is without bias because representatives were drawn before. It is
// not: a node whose near source represents it is opened and all of it is heard, one whose far
// source does is left closed and the far source is heard for both; so the far one is heard too
// loud. Here a node's importance is its volume over the square of the distance to its bounds (to
// the distance, where volumes are amplitudes), which does not depend on the drawing, times what the
// receivers hear of the direction of their middle (of a node one is in, all).
//
// Directions of emission count for nothing in the choice, as in the paper: that is what
// octree-diffusion is for. This tree is the reference; what plays is the tree of
// formats/bake_file/source_octree.h.
//
// Immutable once made. Memory: about 100 bytes per source.
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

  // Of a node: source `point` in place of all, its volume scaled by `factor`.
  struct Representative {
    std::uint32_t point = 0;
    double factor = 1;
  };

  // Volumes fall with the distance to the power of `fall`: 2 for powers, 1 for amplitudes.
  RepresentativeOctree(std::span<const Point> points, double fall, std::uint64_t seed);

  // The cut with k nodes, or up to 6 fewer where opening one more would be too many; by ascending
  // point. All of them when there are no more than k.
  std::vector<Representative> cut(const Vec3& place, std::size_t k,
                                  const Reception& reception = Reception()) const;

 private:
  friend class SlowCut;  // the test's

  struct Node {
    Vec3f low_m{}, high_m{};
    float radius_m = 0;  // the least of its points'
    std::uint32_t point = 0;
    double volume = 0;
    std::uint32_t first_child = 0, children = 0;  // in a row; none: a leaf
  };

  void build(std::uint32_t node, std::span<std::uint32_t> points, const Vec3& centre_m,
             double half_m, int depth);
  void represent(std::uint32_t node, std::uint64_t seed);
  double importance(const Node& node, const Vec3& place, const Reception& reception) const;

  std::span<const Point> points_;  // while it is built
  double fall_;
  std::vector<double> volumes_;  // of points
  std::vector<Node> nodes_;      // children after parents; the root first
};

}  // namespace clamor
