// occluder_plane.h: the plane of a triangle that occludes.
#pragma once

#include <array>
#include <cstdint>

#include "common/vec.h"
#include "formats/level/mesh.h"

namespace clamor {

// dot(normal, x) = offset.
struct OccluderPlane {
  Vec3f normal{};
  float offset_m = 0;

  float height_m(const Vec3f& point_m) const { return glm::dot(normal, point_m) - offset_m; }
};

// The plane of three of a mesh's corners; zero if they are on one line.
inline OccluderPlane plane_of(const Mesh& mesh, const std::array<std::uint32_t, 3>& corners) {
  const Vec3 a = mesh.vertices_m[corners[0]];
  const Vec3 across =
      cross(Vec3(mesh.vertices_m[corners[1]]) - a, Vec3(mesh.vertices_m[corners[2]]) - a);
  const double twice_area = length(across);
  if (!(twice_area > 0)) return {};
  const Vec3 normal = across / twice_area;
  return {Vec3f(normal), static_cast<float>(dot(normal, a))};
}

}  // namespace clamor
