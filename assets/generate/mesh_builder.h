// mesh_builder.h: collects triangles by material and welds their corners.
//
// Normals are omitted: glTF viewers then use flat shading, which suits boxes and steps, and files
// stay small. Corners are counter-clockwise seen from outside.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "common/vec.h"

namespace clamor::assets {

using MaterialIndex = int;

class MeshBuilder {
 public:
  struct Part {
    std::vector<Vec3f> vertices_m;
    std::vector<std::uint32_t> indices;
  };

  // Triangles without area are dropped.
  void triangle(MaterialIndex material, const Vec3& a, const Vec3& b, const Vec3& c);
  void quad(MaterialIndex material, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

  // corners: the bottom ring, then the top ring above it, both counter-clockwise from above.
  // Boxes that stand on a surface have no bottom.
  enum class Bottom { kClosed, kOpen };
  void hexahedron(MaterialIndex material, const std::array<Vec3, 8>& corners, Bottom bottom);
  void box(MaterialIndex material, const Vec3& low_m, const Vec3& high_m,
           Bottom bottom = Bottom::kClosed);

  // An outline in (x, z), counter-clockwise from above and star-shaped about its mean, raised from
  // low_y_m to high_y_m; closed.
  void prism(MaterialIndex material, std::span<const glm::dvec2> outline_m, double low_y_m,
             double high_y_m);

  const std::map<MaterialIndex, Part>& parts() const { return parts_; }
  std::size_t triangle_count() const;

 private:
  std::uint32_t weld(MaterialIndex material, const Vec3& corner_m);

  std::map<MaterialIndex, Part> parts_;
  std::map<std::pair<MaterialIndex, std::array<float, 3>>, std::uint32_t> corners_;
};

}  // namespace clamor::assets
