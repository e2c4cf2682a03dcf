#include "formats/geometry_section.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "formats/bake_layout.h"

namespace clamor {

namespace {

constexpr double kStep_m = 1e-3;
constexpr std::size_t kLargestRatio = 1000;

std::size_t unpacked_bytes(const GeometryCounts& counts) {
  return std::size_t{12} * counts.vertices + std::size_t{14} * counts.triangles;
}

}  // namespace

std::vector<std::byte> pack_geometry(const Mesh& mesh, GeometryCounts& counts) {
  counts = {};
  if (mesh.triangles.empty()) return {};
  counts.vertices = static_cast<std::uint32_t>(mesh.vertices_m.size());
  counts.triangles = static_cast<std::uint32_t>(mesh.triangles.size());
  Vec3f low(mesh.vertices_m[0]);
  for (const Vec3f& vertex : mesh.vertices_m) low = glm::min(low, vertex);
  counts.low_m = Vec3(low);

  std::vector<std::byte> bytes(unpacked_bytes(counts));
  std::byte* at = bytes.data();
  const auto put = [&at](auto value) {
    std::memcpy(at, &value, sizeof(value));
    at += sizeof(value);
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const Vec3f& vertex : mesh.vertices_m)
      put(static_cast<std::uint32_t>(
          std::min(std::round((vertex[axis] - counts.low_m[axis]) / kStep_m), 4294967295.0)));
  for (std::size_t corner = 0; corner < 3; ++corner)
    for (const auto& triangle : mesh.triangles) put(triangle[corner]);
  for (const std::uint16_t material : mesh.materials) put(material);
  return packed(bytes);
}

Result<Mesh> unpack_geometry(std::span<const std::byte> frame, const GeometryCounts& counts,
                             std::size_t materials) {
  Mesh mesh;
  if (counts.triangles == 0) return mesh;
  const std::size_t size = unpacked_bytes(counts);
  if (size > kLargestRatio * frame.size())
    return Error("the geometry claims to be " + std::to_string(size) + " bytes, packed in " +
                 std::to_string(frame.size()));
  const auto bytes = unpacked(frame, size);
  if (!bytes.ok()) return bytes.error().in("the geometry");

  const std::byte* at = bytes->data();
  const auto get = [&at]<class T>(T& value) {
    std::memcpy(&value, at, sizeof(value));
    at += sizeof(value);
  };
  mesh.vertices_m.resize(counts.vertices);
  mesh.triangles.resize(counts.triangles);
  mesh.materials.resize(counts.triangles);
  for (int axis = 0; axis < 3; ++axis)
    for (Vec3f& vertex : mesh.vertices_m) {
      std::uint32_t steps = 0;
      get(steps);
      vertex[axis] = static_cast<float>(counts.low_m[axis] + steps * kStep_m);
    }
  for (std::size_t corner = 0; corner < 3; ++corner)
    for (auto& triangle : mesh.triangles) {
      get(triangle[corner]);
      if (triangle[corner] >= counts.vertices)
        return Error("the geometry has a triangle with a corner that does not exist");
    }
  for (auto& material : mesh.materials) {
    get(material);
    if (material >= materials)
      return Error("the geometry has a triangle of a material that does not exist");
  }
  return mesh;
}

}  // namespace clamor
