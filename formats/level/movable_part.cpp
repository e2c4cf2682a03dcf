#include "formats/level/movable_part.h"

#include <cmath>

#include "common/text.h"

namespace clamor {

namespace {

template <class Vector>
bool is_in_range(const Vector& v) {
  const auto limit = static_cast<typename Vector::value_type>(kMaxPartCoordinate_m);
  return std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit;
}

}  // namespace

Result<void> check(const PartPose& pose) {
  if (!is_in_range(pose.position_m))
    return Error(
        "a movable part must be within 1000 km of the origin; give its position in metres.");
  const double norm = glm::length(Quaternion(pose.rotation));
  if (!(norm > 1e-6 && norm < 1e6))
    return Error(
        "a movable part's rotation must be a quaternion with a length; 1 and three zeros turn "
        "nothing.");
  if (!(pose.scale >= kMinPartScale && pose.scale <= kMaxPartScale))
    return Error(
        "a movable part's scale must lie between 0.001 and 1000; disable a part that "
        "should vanish.");
  return {};
}

Result<void> check_part_mesh(const Mesh& mesh, std::size_t materials) {
  if (mesh.triangles.empty() || mesh.triangles.size() > kMaxMovableTriangles)
    return Error("a movable part has " + std::to_string(mesh.triangles.size()) +
                 " triangles; there may be 1 to " + std::to_string(kMaxMovableTriangles) + ".");
  if (mesh.materials.size() != mesh.triangles.size())
    return Error("a movable part needs one material for each triangle.");
  for (const Vec3f& vertex : mesh.vertices_m)
    if (!is_in_range(vertex))
      return Error("a movable part's corners must be within 1000 km of its pivot; one is not.");
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle)
      if (corner >= mesh.vertices_m.size())
        return Error("a movable part's triangle has corner " + std::to_string(corner) +
                     ", but there are " + std::to_string(mesh.vertices_m.size()) + ".");
  for (const std::uint16_t material : mesh.materials)
    if (material >= materials)
      return Error("a movable part is of material " + std::to_string(material) +
                   ", but there are " + std::to_string(materials) + ".");
  return {};
}

Result<void> check_movable_parts(std::span<const MovablePart> parts, std::size_t materials) {
  if (parts.size() > kMaxMovableParts)
    return Error("there are " + std::to_string(parts.size()) + " movable parts; there may be " +
                 std::to_string(kMaxMovableParts) + ".");
  std::size_t triangles = 0;
  for (const MovablePart& part : parts) {
    if (const auto ok = check_part_mesh(part.mesh, materials); !ok.ok())
      return ok.error().in(in_quotes(part.name));
    if (const auto ok = check(part.rest_pose); !ok.ok()) return ok.error().in(in_quotes(part.name));
    triangles += part.mesh.triangles.size();
  }
  if (triangles > kMaxMovableTriangles)
    return Error("the movable parts have " + std::to_string(triangles) +
                 " triangles; there may be " + std::to_string(kMaxMovableTriangles) + ".");
  return {};
}

PartPose normalized(const PartPose& pose) {
  return {pose.position_m, Rotation(glm::normalize(Quaternion(pose.rotation))), pose.scale};
}

Mesh placed(const Mesh& part, const PartPose& pose) {
  Mesh mesh = part;
  const Matrix axes = pose.scale * glm::mat3_cast(Quaternion(pose.rotation));
  for (Vec3f& vertex : mesh.vertices_m) vertex = Vec3f(pose.position_m + axes * Vec3(vertex));
  return mesh;
}

Mesh box_mesh(const Vec3& half, std::uint16_t material) {
  Mesh mesh;
  for (int corner = 0; corner < 8; ++corner)
    mesh.vertices_m.emplace_back((corner & 1) != 0 ? half.x : -half.x,
                                 (corner & 2) != 0 ? half.y : -half.y,
                                 (corner & 4) != 0 ? half.z : -half.z);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  mesh.materials.assign(mesh.triangles.size(), material);
  return mesh;
}

}  // namespace clamor
