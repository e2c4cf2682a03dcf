// movable_part.h: a part of a level that the game moves: a door, a lift, a barrier.
//
// The bake does not trace movable parts. The runtime occludes with them, wherever they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "common/result.h"
#include "common/vec.h"
#include "formats/level/mesh.h"

namespace clamor {

inline constexpr std::size_t kMaxMovableParts = 4096;
inline constexpr std::size_t kMaxMovableTriangles = std::size_t{1} << 20;  // of all together
inline constexpr double kMaxPartCoordinate_m = 1e6;  // from the level's origin
inline constexpr double kMinPartScale = 1e-3, kMaxPartScale = 1e3;

// A point p of the part is at position + rotation (scale p).
struct PartPose {
  Vec3 position_m{};
  Rotation rotation{1, 0, 0, 0};
  double scale = 1;

  bool operator==(const PartPose&) const = default;
};

struct MovablePart {
  std::string name;
  Mesh mesh;  // relative to the pivot
  PartPose rest_pose;

  bool operator==(const MovablePart&) const = default;
};

// The pose in the world of a pose relative to a level's origin.
inline PartPose in_world(PartPose pose, const Vec3& origin_m) {
  pose.position_m += origin_m;
  return pose;
}

// An error if a number is not finite or out of range.
Result<void> check(const PartPose& pose);

// An error if there are no triangles or too many, if a corner is out of range or not finite, or if
// an index or a material does not exist.
Result<void> check_part_mesh(const Mesh& mesh, std::size_t materials);

// Checks all parts of a level: their number, triangles and rest poses. The Error names the part.
Result<void> check_movable_parts(std::span<const MovablePart> parts, std::size_t materials);

// The pose with a rotation of unit length; the rotation must have a length.
PartPose normalized(const PartPose& pose);

// Returns the part's triangles where a pose places them.
Mesh placed(const Mesh& part, const PartPose& pose);

// A box around the pivot, all of one material.
Mesh box_mesh(const Vec3& half_extents_m, std::uint16_t material);

}  // namespace clamor
