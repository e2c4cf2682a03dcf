#include "runtime/occlusion/part_shape.h"

#include <algorithm>

#include "formats/level/embree_instances.h"
#include "formats/level/embree_mesh.h"
#include "formats/level/movable_part.h"

namespace clamor {

Result<std::shared_ptr<const PartShape>> PartShape::make(const Mesh& mesh,
                                                         std::span<const Material> materials) {
  if (const auto ok = check_part_mesh(mesh, materials.size()); !ok.ok()) return ok.error();
  return std::shared_ptr<const PartShape>(new PartShape(mesh, materials));
}

PartShape::PartShape(const Mesh& mesh, std::span<const Material> materials)
    : edges_(mesh), materials_(mesh.materials), bounds_(bounds_of(mesh.vertices_m)) {
  for (const Material& material : materials) {
    transmission_.push_back(material.transmission);
    mirrored_.push_back(mirror_reflection(material));
  }
  for (const std::uint16_t material : materials_)
    for (const float share : transmission_[material]) transmits_ |= share > 0;
  planes_.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) planes_.push_back(plane_of(mesh, triangle));
  bvh_ = std::make_unique<EmbreeMesh>(
      mesh, EmbreeMesh::Options{
                .robust = true, .alone = true, .shared_device = EmbreeInstances::device()});
  bvh_->build();
}

PartShape::~PartShape() = default;

}  // namespace clamor
