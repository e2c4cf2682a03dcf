#include "runtime/occlusion/part_shape.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "formats/level/embree_instances.h"
#include "formats/level/embree_mesh.h"
#include "formats/level/movable_part.h"

namespace clamor {

namespace {

constexpr double kMinFace_m2 = 0.1;
constexpr std::size_t kMaxFaces = 12, kMaxPatches = 256;
constexpr float kLeastMirrored = 1e-3f;
// Faces whose planes agree as closely are one.
constexpr double kSameNormal = 0.02, kSameOffset_m = 0.02;

// Triangles with nearly the same plane, which is that of the first.
struct Patch {
  Vec3 normal{};
  double offset_m = 0, area_m2 = 0;
  float mirrored = 0;
  Bounds bounds;

  bool has_plane(const Vec3& other, double other_offset_m) const {
    const double side = dot(normal, other) < 0 ? -1 : 1;
    return length(normal - side * other) < kSameNormal &&
           std::abs(offset_m - side * other_offset_m) < kSameOffset_m;
  }
};

// Curved parts have more planes than matter: only so many are told apart.
std::vector<Patch> patches_of(const Mesh& mesh, std::span<const OccluderPlane> planes,
                              std::span<const Bands> mirrored) {
  std::vector<Patch> patches;
  for (std::size_t t = 0; t < planes.size(); ++t) {
    const float most = std::ranges::max(mirrored[mesh.materials[t]]);
    const Vec3 normal(planes[t].normal);
    if (!(most >= kLeastMirrored) || normal == Vec3(0)) continue;
    const auto offset_m = static_cast<double>(planes[t].offset_m);
    auto patch = std::ranges::find_if(
        patches, [&](const Patch& known) { return known.has_plane(normal, offset_m); });
    if (patch == patches.end()) {
      if (patches.size() == kMaxPatches) continue;
      patch = patches.insert(patch, Patch{normal, offset_m, 0, 0, {}});
    }
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3 corner_m(mesh.vertices_m[a]);
    patch->area_m2 +=
        length(cross(Vec3(mesh.vertices_m[b]) - corner_m, Vec3(mesh.vertices_m[c]) - corner_m)) / 2;
    patch->mirrored = std::max(patch->mirrored, most);
    for (const std::uint32_t corner : mesh.triangles[t])
      patch->bounds.add(Vec3(mesh.vertices_m[corner]));
  }
  return patches;
}

PartShape::Face face_of(const Patch& patch, const Mesh& mesh) {
  PartShape::Face face{{patch.normal, patch.offset_m},
                       0.5 * (patch.bounds.low_m + patch.bounds.high_m),
                       patch.bounds.diagonal_m() / 2,
                       patch.area_m2,
                       patch.mirrored};
  double lowest_m = 0, highest_m = 0;
  for (const Vec3f& vertex : mesh.vertices_m) {
    const double height_m = face.height_m(Vec3(vertex));
    lowest_m = std::min(lowest_m, height_m);
    highest_m = std::max(highest_m, height_m);
  }
  if (highest_m > kSameOffset_m && lowest_m > -kSameOffset_m) face.turn_round();
  face.is_outside = (highest_m > kSameOffset_m) != (lowest_m < -kSameOffset_m);
  return face;
}

std::vector<PartShape::Face> faces_of(const Mesh& mesh, std::span<const OccluderPlane> planes,
                                      std::span<const Bands> mirrored) {
  std::vector<Patch> patches = patches_of(mesh, planes, mirrored);
  std::erase_if(patches, [](const Patch& patch) { return patch.area_m2 < kMinFace_m2; });
  std::ranges::stable_sort(patches, std::greater<>(), &Patch::area_m2);
  patches.resize(std::min(patches.size(), kMaxFaces));
  std::vector<PartShape::Face> faces;
  for (const Patch& patch : patches) faces.push_back(face_of(patch, mesh));
  return faces;
}

}  // namespace

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
  faces_ = faces_of(mesh, planes_, mirrored_);
  bvh_ = std::make_unique<EmbreeMesh>(
      mesh, EmbreeMesh::Options{
                .robust = true, .alone = true, .shared_device = EmbreeInstances::device()});
  bvh_->build();
}

PartShape::~PartShape() = default;

}  // namespace clamor
