// part_shape.h: the triangles of a movable part as rays need them: a BVH in the part's own
// coordinates, the planes of its triangles and what they transmit. All listeners share it.
//
// Threads: any; nothing changes after make().   Memory: about 200 bytes per triangle.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/bounds.h"
#include "common/material.h"
#include "common/result.h"
#include "common/vec.h"
#include "formats/level/mesh.h"
#include "runtime/occlusion/diffracting_edges.h"
#include "runtime/occlusion/mirror_plane.h"
#include "runtime/occlusion/occluder_plane.h"

namespace clamor {

class EmbreeMesh;

// A mirror that absorbs a tenth, for parts of which only the transmission is told.
inline Material mirror_material() {
  Material material;
  material.absorption = same_in_all_bands(0.1f);
  material.scattering = Bands{};
  material.phong = same_in_all_bands(kMirrorExponent);
  return material;
}

class PartShape {
 public:
  // Builds the BVH: a second for a million triangles. Errors: see check_part_mesh(). Throws
  // std::bad_alloc if memory runs out.
  static Result<std::shared_ptr<const PartShape>> make(const Mesh& mesh,
                                                       std::span<const Material> materials);
  ~PartShape();

  const EmbreeMesh& bvh() const { return *bvh_; }
  const OccluderPlane& plane(std::uint32_t triangle) const { return planes_[triangle]; }
  const Bands& transmission(std::uint32_t triangle) const {
    return transmission_[materials_[triangle]];
  }
  // Share of the power that a triangle reflects as a mirror.
  const Bands& mirrored(std::uint32_t triangle) const { return mirrored_[materials_[triangle]]; }
  bool transmits() const { return transmits_; }  // whether any material does

  // Coplanar triangles that are mirrors, of 0.1 m2 or more: the largest 12.
  struct Face : MirrorPlane {  // the normal is outwards, if it has an outer side
    Vec3 centre_m{};
    double radius_m = 0;  // of a sphere around it
    double area_m2 = 0;
    float reflected = 0;     // share of the power, in the loudest band
    bool is_outside = true;  // all of the part is behind it; otherwise both sides count
  };
  const std::vector<Face>& faces() const { return faces_; }
  const DiffractingEdges& edges() const { return edges_; }
  std::size_t triangles() const { return planes_.size(); }

  // The corners of the bounding box, in the part's coordinates.
  const Boundsf& bounds() const { return bounds_; }

 private:
  PartShape(const Mesh& mesh, std::span<const Material> materials);

  std::unique_ptr<EmbreeMesh> bvh_;
  std::vector<OccluderPlane> planes_;  // per triangle
  DiffractingEdges edges_;
  std::vector<std::uint16_t> materials_;        // per triangle
  std::vector<Bands> transmission_, mirrored_;  // per material
  bool transmits_ = false;
  std::vector<Face> faces_;
  Boundsf bounds_;
};

}  // namespace clamor
