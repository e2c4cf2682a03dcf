#include "bake/mesh/mesh_simplification.h"

#include <algorithm>
#include <cassert>
#include <queue>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "bake/mesh/collapse_distance.h"
#include "bake/mesh/edge_surroundings.h"
#include "bake/mesh/triangle_tree.h"

namespace clamor {

namespace {

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

struct Traits : OpenMesh::DefaultTraits {
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
using Surface = OpenMesh::TriMesh_ArrayKernelT<Traits>;
using Vertex = Surface::VertexHandle;
using Halfedge = Surface::HalfedgeHandle;
using Edge = Surface::EdgeHandle;
using Face = Surface::FaceHandle;

// Limits on vertex valence, because the cost of a fan is quadratic in it.
constexpr std::uint32_t kMostSpokes = 256;  // for vertices whose triangles are detached
constexpr std::size_t kMostRemovable = 32;  // for vertices that may be removed

// The triangles around a vertex on one side of its constraint lines, or all of them.
struct Fan {
  std::vector<Vec3> ring;
  std::vector<Face> faces;
  bool closed = false;
};

struct Candidate {
  double error;
  std::uint32_t vertex, round;
  // Std::priority_queue returns the largest element first.
  bool operator<(const Candidate& other) const {
    return error != other.error ? error > other.error : vertex > other.vertex;
  }
};

class Simplifier {
 public:
  Simplifier(const PreparedMesh& prepared, double tolerance_m)
      : prepared_(prepared), tolerance_m_(tolerance_m) {
    build();
    draw_lines();
    hold_contacts();
    for (const auto vertex : surface_.vertices()) measure(vertex);
  }

  void run() {
    for (const auto vertex : surface_.vertices()) enqueue(vertex);
    while (!queue_.empty()) {
      const Candidate next = queue_.top();
      queue_.pop();
      const Vertex vertex(static_cast<int>(next.vertex));
      if (surface_.status(vertex).deleted() || surface_.data(vertex).round != next.round) continue;
      remove(vertex);
    }
  }

  Simplification result() const {
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

 private:
  Vec3 at(Vertex vertex) const {
    const auto& p = surface_.point(vertex);
    return {p[0], p[1], p[2]};
  }

  // Adds the triangles one by one, all of a sheet with the same winding. Triangles that OpenMesh
  // rejects, or at a vertex of very high valence, get vertices of their own and keep their shape.
  void build() {
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
        crowded = crowded || spokes[corners[c]] > kMostSpokes;
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
  void draw_lines() {
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
  void hold_contacts() {
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
      // Uses input indices, because build() may have duplicated vertices.
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
    const auto held = contacts(mesh, tree, edges, 2 * prepared_.weld_m, tolerance_m_);
    for (const std::uint32_t triangle : held)
      surface_.data(face_of_[triangle]).may_m = prepared_.weld_m;
  }

  // Accumulates the quadrics of the planes around a vertex, weighted by area, and of its constraint
  // lines.
  void measure(Vertex vertex) {
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

  bool is_line(Edge edge) const { return surface_.status(edge).feature(); }

  double error_of(Halfedge halfedge) const {
    const Vertex from = surface_.from_vertex_handle(halfedge),
                 to = surface_.to_vertex_handle(halfedge);
    return std::max(0.0, surface_.data(from).error.at(at(to)) + surface_.data(to).error.at(at(to)));
  }

  // Collapse targets that the constraint lines allow, lowest error first.
  const std::vector<std::pair<double, Halfedge>>& ways_of(Vertex vertex) {
    ways_.clear();
    std::size_t lines = 0, spokes = 0;
    for (const auto halfedge : surface_.voh_range(vertex)) {
      ++spokes;
      lines += is_line(surface_.edge_handle(halfedge));
    }
    if (spokes < 2 || spokes > kMostRemovable || (lines != 0 && lines != 2)) return ways_;
    for (const auto halfedge : surface_.voh_range(vertex))
      if (lines == 0 || is_line(surface_.edge_handle(halfedge)))
        ways_.emplace_back(error_of(halfedge), halfedge);
    std::sort(ways_.begin(), ways_.end(), [this](const auto& a, const auto& b) {
      return a.first != b.first ? a.first < b.first
                                : surface_.to_vertex_handle(a.second).idx() <
                                      surface_.to_vertex_handle(b.second).idx();
    });
    return ways_;
  }

  void enqueue(Vertex vertex) {
    const std::uint32_t round = ++surface_.data(vertex).round;
    const auto& ways = ways_of(vertex);
    if (!ways.empty())
      queue_.push({ways.front().first, static_cast<std::uint32_t>(vertex.idx()), round});
  }

  // The fans around a half-edge's start, each beginning with the half-edge's end: one for an
  // interior vertex, or one on each side of its constraint lines.
  void find_fans(Halfedge halfedge) {
    fans_.clear();
    if (!is_line(surface_.edge_handle(halfedge))) {
      Fan all;
      all.closed = true;
      Halfedge spoke = halfedge;
      do {
        all.ring.push_back(at(surface_.to_vertex_handle(spoke)));
        all.faces.push_back(surface_.face_handle(spoke));
        spoke = surface_.ccw_rotated_halfedge_handle(spoke);
      } while (spoke != halfedge);
      fans_.push_back(std::move(all));
      return;
    }
    for (const bool left : {true, false}) {
      Fan fan;
      Halfedge spoke = halfedge;
      while (true) {
        fan.ring.push_back(at(surface_.to_vertex_handle(spoke)));
        if (fan.ring.size() > 1 && is_line(surface_.edge_handle(spoke))) break;
        const Halfedge side = left ? spoke : surface_.opposite_halfedge_handle(spoke);
        if (surface_.is_boundary(side)) break;
        fan.faces.push_back(surface_.face_handle(side));
        spoke = left ? surface_.ccw_rotated_halfedge_handle(spoke)
                     : surface_.cw_rotated_halfedge_handle(spoke);
      }
      if (!fan.faces.empty()) fans_.push_back(std::move(fan));
    }
  }

  // Whether the collapse preserves topology, constraint lines and tolerance. On success moved_
  // holds the new bound of each fan.
  bool may_collapse(Halfedge halfedge) {
    if (!surface_.is_collapse_ok(halfedge)) return false;
    // Two constraint lines must not coincide.
    for (const Halfedge side : {halfedge, surface_.opposite_halfedge_handle(halfedge)}) {
      if (surface_.is_boundary(side)) continue;
      const Halfedge next = surface_.next_halfedge_handle(side),
                     last = surface_.next_halfedge_handle(next);
      if (is_line(surface_.edge_handle(next)) && is_line(surface_.edge_handle(last))) return false;
    }
    find_fans(halfedge);
    moved_.clear();
    const Vec3 centre = at(surface_.from_vertex_handle(halfedge));
    for (const Fan& fan : fans_) {
      const auto distance_m = collapse_distance_m(centre, fan.ring, fan.closed, prepared_.weld_m);
      if (!distance_m) return false;
      double moved_m = 0, may_m = tolerance_m_;
      for (const Face face : fan.faces) {
        moved_m = std::max(moved_m, surface_.data(face).moved_m);
        may_m = std::min(may_m, surface_.data(face).may_m);
      }
      moved_m += *distance_m;
      if (moved_m > may_m) return false;
      moved_.emplace_back(moved_m, may_m);
    }
    return true;
  }

  void remove(Vertex vertex) {
    ways_of(vertex);
    for (std::size_t i = 0; i < ways_.size(); ++i) {
      const Halfedge halfedge = ways_[i].second;
      if (!may_collapse(halfedge)) continue;
      collapse(halfedge);
      return;
    }
  }

  void collapse(Halfedge halfedge) {
    const Vertex from = surface_.from_vertex_handle(halfedge),
                 to = surface_.to_vertex_handle(halfedge);
    for (std::size_t i = 0; i < fans_.size(); ++i)
      for (const Face face : fans_[i].faces) {
        surface_.data(face).moved_m = moved_[i].first;
        surface_.data(face).may_m = moved_[i].second;
      }
    // A removed face leaves one of its two sides, which is a constraint line if either was.
    std::vector<Vertex> lines;
    for (const Halfedge side : {halfedge, surface_.opposite_halfedge_handle(halfedge)}) {
      if (surface_.is_boundary(side)) continue;
      const Halfedge next = surface_.next_halfedge_handle(side),
                     last = surface_.next_halfedge_handle(next);
      if (is_line(surface_.edge_handle(next)) || is_line(surface_.edge_handle(last)))
        lines.push_back(surface_.to_vertex_handle(next));
    }
    surface_.data(to).error.add(surface_.data(from).error);
    surface_.collapse(halfedge);
    for (const Vertex other : lines) {
      const Halfedge left = surface_.find_halfedge(to, other);
      surface_.status(surface_.edge_handle(left)).set_feature(true);
    }
    enqueue(to);
    for (const auto neighbour : surface_.vv_range(to)) enqueue(neighbour);
  }

  const PreparedMesh& prepared_;
  double tolerance_m_;
  Surface surface_;
  std::vector<Face> face_of_;  // per triangle
  std::priority_queue<Candidate> queue_;
  std::vector<std::pair<double, Halfedge>> ways_;
  std::vector<Fan> fans_;
  std::vector<std::pair<double, double>> moved_;  // per fan: moved_m, may_m
};

}  // namespace

Simplification simplify(const PreparedMesh& prepared, double tolerance_m) {
  assert(tolerance_m > 0);
  Simplifier simplifier(prepared, tolerance_m);
  simplifier.run();
  return simplifier.result();
}

}  // namespace clamor
