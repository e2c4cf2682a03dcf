// triangle_tree.h: nearest-triangle queries with a bounding volume hierarchy.
//
// The BVH is split at the median along the longest axis, so its depth is log2 n for any input.
// Distances are exact in double. Among equally near triangles the first in the mesh is returned, so
// the answer does not depend on the tree.
//
// Threads: nearest() may be called concurrently. Memory: about 20 bytes per triangle.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "common/bounds.h"
#include "formats/level/mesh.h"

namespace clamor {

// The point of the triangle a, b, c nearest to p.
Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

class TriangleTree {
 public:
  struct Nearest {
    std::uint32_t triangle = 0;
    Vec3 point_m{};
    double distance_m = 0;
  };
  // Filter: whether a triangle, given its nearest point, is a valid answer.
  using Accepts = std::function<bool(std::uint32_t triangle, const Vec3& point_m)>;

  // The mesh must outlive the tree.
  explicit TriangleTree(const Mesh& mesh);

  // The nearest accepted triangle within `within_m`; an empty filter accepts all. Where boxes
  // overlap, a search may visit all nodes and triangles: at most `max_visits` of them, and the
  // nearest triangle of these is returned. Counts the visits in `visits` unless that is null.
  std::optional<Nearest> nearest(const Vec3& point_m, double within_m, const Accepts& accepts = {},
                                 std::size_t max_visits = std::numeric_limits<std::size_t>::max(),
                                 std::size_t* visits = nullptr) const;

 private:
  struct Node {
    Boundsf box;
    // Leaf: position in order_; inner node: second child (the first child follows its parent).
    std::uint32_t first = 0;
    std::uint32_t count = 0;  // triangles of a leaf; 0 for an inner node
  };

  void build(std::uint32_t first, std::uint32_t last);

  const Mesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace clamor
