// triangle_tree.h: the nearest triangle to a point.
//
// A tree of bounding boxes, halved by count along the longest axis, so its depth is log2 n for any
// input. Distances are exact in double; of triangles equally near the first in the mesh counts, so
// the answer does not depend on how the tree was built.
//
// Threads: nearest() from any number at once.   Memory: about 20 bytes per triangle.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "formats/level/level.h"

namespace clamor {

// The point of the triangle a, b, c that is nearest to p.
Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

class TriangleTree {
 public:
  struct Nearest {
    std::uint32_t triangle = 0;
    Vec3 point_m{};
    double distance_m = 0;
  };
  // Whether a triangle, with its point nearest to the one asked about, may be the answer.
  using Accepts = std::function<bool(std::uint32_t triangle, const Vec3& point_m)>;

  // The mesh must outlive the tree.
  explicit TriangleTree(const Mesh& mesh);

  // The nearest triangle no further than `within_m` that is accepted; an empty function accepts
  // all. At most `most_looks` triangles are looked at; then the nearest of these is the answer.
  std::optional<Nearest> nearest(
      const Vec3& point_m, double within_m, const Accepts& accepts = {},
      std::size_t most_looks = std::numeric_limits<std::size_t>::max()) const;

 private:
  struct Box {
    Vec3f low_m, high_m;
    double distance2_m2(const Vec3& p) const;
  };
  struct Node {
    Box box;
    std::uint32_t first = 0;  // triangle in order_, or the second child: the first follows its node
    std::uint32_t count = 0;  // of triangles; 0 within the tree
  };

  void build(std::uint32_t first, std::uint32_t last);

  const Mesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace clamor
