// door_leaf.h: the leaf of the door of two_rooms.h, as a movable part.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "formats/bake_file/geometry_section.h"
#include "formats/level/movable_part.h"

namespace clamor::testing {

inline constexpr Vec3 kHinge_m{5.05, 1.5, 0};

// 1 x 2 m and 4 cm thick, as wide as the doorway; the pivot is its lower corner at the hinge.
inline Mesh door_leaf(std::uint16_t material = 0) {
  Mesh mesh = box_mesh({0.02, 0.5, 1}, material);
  for (Vec3f& vertex : mesh.vertices_m) vertex += Vec3f(0, 0.5f, 1);
  return mesh;
}

inline PartPose door_pose(double open_deg) {
  const double half_rad = open_deg / 2 * std::numbers::pi / 180;
  return {kHinge_m, Rotation(static_cast<float>(std::cos(half_rad)), 0, 0,
                             static_cast<float>(std::sin(half_rad)))};
}

inline MovablePart door(double open_deg, std::uint16_t material = 0) {
  return {"Door", door_leaf(material), door_pose(open_deg)};
}

// The mesh with the parts built in where they are.
inline Mesh with_built_in(Mesh mesh, const std::vector<MovablePart>& parts) {
  for (const MovablePart& part : parts) append(placed(part.mesh, part.rest_pose), mesh);
  return mesh;
}

}  // namespace clamor::testing
