#include "bake/mesh/collapsible_surface.h"

#include <algorithm>
#include <array>
#include <utility>

#include "bake/mesh/edge_surroundings.h"
#include "bake/mesh/triangle_tree.h"

namespace clamor {

CollapsibleSurface::CollapsibleSurface(const PreparedMesh& prepared, double tolerance_m)
    : prepared_(prepared), tolerance_m_(tolerance_m) {
  add_triangles();
  mark_lines();
  fix_contacts();
  for (const auto vertex : surface_.vertices()) add_quadrics(vertex);
}

// Adds the triangles one by one, all of a sheet with the same winding. Triangles that OpenMesh
// rejects, or at a vertex of very high valence, get vertices of their own and keep their shape.
void CollapsibleSurface::add_triangles() {
  const Mesh& mesh = prepared_.mesh;
  const auto add_vertex = [&](std::uint32_t vertex) {
    const Vec3f& p = mesh.vertices_m[vertex];
    return surface_.add_vertex(Surface::Point(static_cast<double>(p.x), static_cast<double>(p.y),
                                              static_cast<double>(p.z)));
  };
  std::vector<std::uint32_t> spokes(mesh.vertices_m.size(), 0);
  for (const auto& triangle : mesh.triangles)
    for (const auto corner : triangle) ++spokes[corner];
  surface_.reserve(mesh.vertices_m.size(), 3 * mesh.triangles.size() / 2 + 16,
                   mesh.triangles.size());
  for (std::uint32_t v = 0; v < mesh.vertices_m.size(); ++v) add_vertex(v);

  face_of_.reserve(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    auto corners = mesh.triangles[t];
    if (prepared_.turned[t] != 0) std::swap(corners[1], corners[2]);
    std::array<Vertex, 3> vertices;
    bool crowded = false;
    for (std::size_t c = 0; c < 3; ++c) {
      vertices[c] = Vertex(static_cast<int>(corners[c]));
      crowded = crowded || spokes[corners[c]] > kMaxSpokes;
    }
    Face face;
    if (!crowded) face = surface_.add_face(vertices[0], vertices[1], vertices[2]);
    if (!face.is_valid()) {
      for (std::size_t c = 0; c < 3; ++c) vertices[c] = add_vertex(corners[c]);
      face = surface_.add_face(vertices[0], vertices[1], vertices[2]);
    }
    surface_.data(face).material = mesh.materials[t];
    surface_.data(face).may_m = tolerance_m_;
    face_of_.push_back(face);
  }
}

// Constraint lines: boundaries, feature edges and material borders.
void CollapsibleSurface::mark_lines() {
  for (const auto edge : surface_.edges()) {
    bool line = surface_.is_boundary(edge);
    if (!line) {
      const Face a = surface_.face_handle(surface_.halfedge_handle(edge, 0)),
                 b = surface_.face_handle(surface_.halfedge_handle(edge, 1));
      line = surface_.data(a).material != surface_.data(b).material;
    }
    surface_.status(edge).set_feature(line);
  }
  for (const MeshEdge& feature : prepared_.feature_edges) {
    const auto halfedge = surface_.find_halfedge(Vertex(static_cast<int>(feature.vertices[0])),
                                                 Vertex(static_cast<int>(feature.vertices[1])));
    if (halfedge.is_valid()) surface_.status(surface_.edge_handle(halfedge)).set_feature(true);
  }
}

// Fixes vertices where the edge of a sheet comes within the tolerance of another triangle.
void CollapsibleSurface::fix_contacts() {
  const Mesh& mesh = prepared_.mesh;
  std::vector<std::uint32_t> triangle_of(surface_.n_faces());
  for (std::uint32_t t = 0; t < face_of_.size(); ++t)
    triangle_of[static_cast<std::size_t>(face_of_[t].idx())] = t;
  std::vector<MeshEdge> edges;
  for (const auto halfedge : surface_.halfedges()) {
    if (!surface_.is_boundary(halfedge)) continue;
    const Face face = surface_.face_handle(surface_.opposite_halfedge_handle(halfedge));
    const std::uint32_t t = triangle_of[static_cast<std::size_t>(face.idx())];
    MeshEdge edge;
    edge.triangle = t;
    // Uses input indices, because add_triangles() may have duplicated vertices.
    const Vec3f from(at(surface_.from_vertex_handle(halfedge))),
        to(at(surface_.to_vertex_handle(halfedge)));
    for (const std::uint32_t corner : mesh.triangles[t]) {
      if (mesh.vertices_m[corner] == from) edge.vertices[0] = corner;
      if (mesh.vertices_m[corner] == to) edge.vertices[1] = corner;
    }
    edge.length_m = length(Vec3(to) - Vec3(from));
    edges.push_back(edge);
  }
  const TriangleTree tree(mesh);
  const auto touching = contacts(mesh, tree, edges, 2 * prepared_.weld_m, tolerance_m_);
  for (const std::uint32_t triangle : touching)
    surface_.data(face_of_[triangle]).may_m = prepared_.weld_m;
}

// Accumulates the quadrics of the planes around a vertex, weighted by area, and of its constraint
// lines.
void CollapsibleSurface::add_quadrics(Vertex vertex) {
  Quadric sum;
  const Vec3 here = at(vertex);
  for (const auto halfedge : surface_.voh_range(vertex)) {
    if (surface_.is_boundary(halfedge)) continue;
    const Vec3 b = at(surface_.to_vertex_handle(halfedge)) - here,
               c = at(surface_.opposite_vh(halfedge)) - here;
    const Vec3 across = cross(b, c);
    const double twice_area = length(across);
    if (!(twice_area > 0)) continue;
    const Vec3 normal = across / twice_area;
    sum.add_plane(normal, here, twice_area);
    if (!is_line(surface_.edge_handle(halfedge))) continue;
    sum.add_plane(normalize(cross(b, normal)), here, dot(b, b));
  }
  surface_.data(vertex).error = sum;
}

Simplification CollapsibleSurface::remaining() const {
  Simplification result;
  std::vector<std::uint32_t> place(surface_.n_vertices(), 0xffffffff);
  for (std::uint32_t t = 0; t < face_of_.size(); ++t) {
    const Face face = face_of_[t];
    if (surface_.status(face).deleted()) continue;
    std::array<std::uint32_t, 3> triangle;
    std::size_t c = 0;
    for (const auto vertex : surface_.fv_range(face)) {
      std::uint32_t& index = place[static_cast<std::size_t>(vertex.idx())];
      if (index == 0xffffffff) {
        index = static_cast<std::uint32_t>(result.mesh.vertices_m.size());
        result.mesh.vertices_m.emplace_back(at(vertex));
      }
      triangle[c++] = index;
    }
    if (prepared_.turned[t] != 0) std::swap(triangle[1], triangle[2]);
    result.mesh.triangles.push_back(triangle);
    result.mesh.materials.push_back(surface_.data(face).material);
    result.error_m = std::max(result.error_m, surface_.data(face).moved_m);
  }
  return result;
}

}  // namespace clamor
