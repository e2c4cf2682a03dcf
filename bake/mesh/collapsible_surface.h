// collapsible_surface.h: a prepared mesh as an OpenMesh surface whose edges can be collapsed.
//
// Vertices carry the quadric of their planes, faces the distance that they may still move, and
// edges whether they are constraint lines. Behind OpenMesh's fence: only mesh_simplification.cpp
// includes this header.
#pragma once

#include <cstdint>
#include <vector>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "bake/mesh/mesh_preparation.h"
#include "bake/mesh/mesh_simplification.h"
#include "common/vec.h"

namespace clamor {

// Weighted sum of squared distances to planes, as a quadratic form.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, x = 0, yy = 0, yz = 0, y = 0, zz = 0, z = 0, one = 0;

  void add_plane(const Vec3& n, const Vec3& through, double weight) {
    const double d = -dot(n, through);
    xx += weight * n.x * n.x, xy += weight * n.x * n.y, xz += weight * n.x * n.z;
    yy += weight * n.y * n.y, yz += weight * n.y * n.z, zz += weight * n.z * n.z;
    x += weight * n.x * d, y += weight * n.y * d, z += weight * n.z * d, one += weight * d * d;
  }
  void add(const Quadric& q) {
    xx += q.xx, xy += q.xy, xz += q.xz, x += q.x, yy += q.yy;
    yz += q.yz, y += q.y, zz += q.zz, z += q.z, one += q.one;
  }
  double at(const Vec3& p) const {
    return p.x * (xx * p.x + 2 * (xy * p.y + xz * p.z + x)) +
           p.y * (yy * p.y + 2 * (yz * p.z + y)) + p.z * (zz * p.z + 2 * z) + one;
  }
};

struct SurfaceTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
  VertexTraits {
    Quadric error;
    std::uint32_t round = 0;  // version number of the valid queue entry
  };
  FaceTraits {
    double moved_m = 0;  // upper bound of the distance to the input
    double may_m = 0;    // tolerance of this triangle
    std::uint16_t material = 0;
  };
};
using Surface = OpenMesh::TriMesh_ArrayKernelT<SurfaceTraits>;
using Vertex = Surface::VertexHandle;
using Halfedge = Surface::HalfedgeHandle;
using Edge = Surface::EdgeHandle;
using Face = Surface::FaceHandle;

class CollapsibleSurface {
 public:
  // A vertex with more triangles is not joined.
  static constexpr std::uint32_t kMaxSpokes = 256;

  // `prepared` must outlive the object.
  CollapsibleSurface(const PreparedMesh& prepared, double tolerance_m);

  Surface& mesh() { return surface_; }
  double weld_m() const { return prepared_.weld_m; }
  double tolerance_m() const { return tolerance_m_; }

  Vec3 at(Vertex vertex) const {
    const auto& p = surface_.point(vertex);
    return {p[0], p[1], p[2]};
  }
  bool is_line(Edge edge) const { return surface_.status(edge).feature(); }

  // The remaining triangles, in the order and the winding of the input.
  Simplification remaining() const;

 private:
  void add_triangles();
  void mark_lines();
  void fix_contacts();
  void add_quadrics(Vertex vertex);

  const PreparedMesh& prepared_;
  double tolerance_m_;
  Surface surface_;
  std::vector<Face> face_of_;  // per triangle
};

}  // namespace clamor
