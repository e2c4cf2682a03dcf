#include "bake/mesh/mesh_preparation.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>

#include "bake/mesh/vertex_welding.h"
#include "common/disjoint_sets.h"

namespace clamor {

namespace {

using Triangle = std::array<std::uint32_t, 3>;

// Half-edge of a triangle from corner s to s + 1, sorted by the pair of welded vertices.
struct Side {
  std::uint32_t low, high;
  std::uint32_t triangle;
  std::uint32_t corner;

  bool same_edge(const Side& other) const { return low == other.low && high == other.high; }
  bool operator<(const Side& other) const {
    return low != other.low     ? low < other.low
           : high != other.high ? high < other.high
                                : triangle < other.triangle;
  }
};

std::vector<Side> sides_of(const std::vector<Triangle>& triangles) {
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::uint32_t c = 0; c < 3; ++c) {
      const auto [low, high] = std::minmax(triangles[t][c], triangles[t][(c + 1) % 3]);
      sides.push_back({low, high, t, c});
    }
  std::sort(sides.begin(), sides.end());
  return sides;
}

// Calls visit(first, last) with the half-edges of each edge.
template <class Visit>
void for_each_edge(const std::vector<Side>& sides, const Visit& visit) {
  for (std::size_t first = 0; first < sides.size();) {
    std::size_t last = first + 1;
    while (last < sides.size() && sides[first].same_edge(sides[last])) ++last;
    visit(first, last);
    first = last;
  }
}

class Preparation {
 public:
  Preparation(const Mesh& mesh, const PreparationOptions& options) : input_(mesh) {
    out_.weld_m = options.weld_m > 0 ? options.weld_m : weld_distance_m(mesh, options.rounding_m);
  }

  PreparedMesh run() {
    weld();
    drop_duplicates();
    sides_ = sides_of(triangles_);
    orient();
    split();
    find_edges();
    return std::move(out_);
  }

 private:
  void weld() {
    Welding welding = weld_vertices(input_, out_.weld_m);
    out_.welded_vertices = welding.welded;
    for (std::size_t t = 0; t < input_.triangles.size(); ++t) {
      Triangle corners = input_.triangles[t];
      for (auto& corner : corners) corner = welding.representative[corner];
      const double area = area_of(corners);
      if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0] ||
          !(area > 0)) {
        ++out_.degenerate;
        out_.degenerate_m2 += area_m2(input_, t);
        continue;
      }
      triangles_.push_back(corners);
      materials_.push_back(input_.materials[t]);
    }
  }

  // Duplicates have the same vertices in any order; the first in the file is kept.
  void drop_duplicates() {
    struct Key {
      Triangle sorted;
      std::uint32_t triangle;
      bool operator<(const Key& other) const {
        return sorted != other.sorted ? sorted < other.sorted : triangle < other.triangle;
      }
    };
    std::vector<Key> keys;
    keys.reserve(triangles_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      keys.push_back({triangles_[t], t});
      std::sort(keys.back().sorted.begin(), keys.back().sorted.end());
    }
    std::sort(keys.begin(), keys.end());

    std::vector<bool> dropped(triangles_.size(), false);
    std::map<std::pair<std::uint16_t, std::uint16_t>, MaterialClash> clashes;
    std::map<std::pair<std::uint16_t, std::uint16_t>, double> largest_m2;
    for (std::size_t first = 0, i = 1; i < keys.size(); ++i) {
      if (keys[i].sorted != keys[first].sorted) {
        first = i;
        continue;
      }
      const std::uint32_t t = keys[i].triangle;
      dropped[t] = true;
      ++out_.duplicated;
      out_.duplicated_m2 += area_of(triangles_[t]);
      const std::pair materials(materials_[keys[first].triangle], materials_[t]);
      if (materials.first == materials.second) continue;
      MaterialClash& clash = clashes[materials];
      clash.kept = materials.first;
      clash.dropped = materials.second;
      ++clash.faces;
      const double face_m2 = area_of(triangles_[t]);
      clash.area_m2 += face_m2;
      if (double& largest = largest_m2[materials]; face_m2 > largest) {
        largest = face_m2;
        clash.place_m = middle_of(triangles_[t]);
      }
    }
    for (const auto& [materials, clash] : clashes) out_.clashes.push_back(clash);
    std::stable_sort(out_.clashes.begin(), out_.clashes.end(),
                     [](const auto& a, const auto& b) { return a.area_m2 > b.area_m2; });

    std::size_t kept = 0;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (dropped[t]) continue;
      triangles_[kept] = triangles_[t];
      materials_[kept++] = materials_[t];
    }
    triangles_.resize(kept);
    materials_.resize(kept);
  }

  // Returns whether two faces agree in orientation after flipping those marked as turned: their
  // half-edges then run in opposite directions.
  bool face_alike(const Side& a, const Side& b) const {
    const auto forward = [this](const Side& side) {
      return (triangles_[side.triangle][side.corner] == side.low) !=
             static_cast<bool>(out_.turned[side.triangle]);
    };
    return forward(a) != forward(b);
  }

  // Flood fill over edges of two faces that marks triangles with the opposite winding.
  void orient() {
    constexpr std::uint32_t kNobody = 0xffffffff;
    std::vector<std::uint32_t> own(3 * triangles_.size(), kNobody), across(own);  // per half-edge
    for_each_edge(sides_, [&](std::size_t first, std::size_t last) {
      if (last - first != 2) return;
      for (const std::size_t i : {first, first + 1}) {
        const std::size_t side = 3 * std::size_t{sides_[i].triangle} + sides_[i].corner;
        own[side] = static_cast<std::uint32_t>(i);
        across[side] = static_cast<std::uint32_t>(i == first ? first + 1 : first);
      }
    });
    out_.turned.assign(triangles_.size(), 0);
    std::vector<bool> seen(triangles_.size(), false);
    std::vector<std::uint32_t> waiting;
    for (std::uint32_t start = 0; start < triangles_.size(); ++start) {
      if (seen[start]) continue;
      seen[start] = true;
      waiting.push_back(start);
      while (!waiting.empty()) {
        const std::size_t side = 3 * std::size_t{waiting.back()};
        waiting.pop_back();
        for (std::size_t s = side; s < side + 3; ++s) {
          if (across[s] == kNobody) continue;
          const Side& other = sides_[across[s]];
          if (seen[other.triangle]) continue;
          seen[other.triangle] = true;
          out_.turned[other.triangle] = face_alike(sides_[own[s]], other) ? 0 : 1;
          waiting.push_back(other.triangle);
        }
      }
    }
  }

  // Corners are joined across edges of two faces; each joined set becomes one vertex. The corners
  // of a vertex form a path or a ring, because each is joined to at most two others. Of the faces
  // at a non-manifold edge at most two, the ends of one path, still share it; those close a ring.
  void split() {
    DisjointSets<std::uint32_t> joined(3 * triangles_.size());  // one element per corner
    const auto corner_at = [this](const Side& side, std::uint32_t vertex) {
      const std::uint32_t next = (side.corner + 1) % 3;
      return 3 * side.triangle +
             (triangles_[side.triangle][side.corner] == vertex ? side.corner : next);
    };
    for_each_edge(sides_, [&](std::size_t first, std::size_t last) {
      const bool whole = last - first == 2 && face_alike(sides_[first], sides_[first + 1]);
      if (last - first > 1 && !whole) ++out_.split_edges;
      if (!whole) return;
      for (const std::uint32_t vertex : {sides_[first].low, sides_[first].high}) {
        joined.join(corner_at(sides_[first], vertex), corner_at(sides_[first + 1], vertex));
      }
    });

    // New vertices are numbered in the order in which triangles use them.
    constexpr std::uint32_t kNone = 0xffffffff;
    std::vector<std::uint32_t> place(3 * triangles_.size(), kNone);
    std::vector<bool> known(input_.vertices_m.size(), false);
    Mesh& mesh = out_.mesh;
    mesh.triangles.resize(triangles_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      for (std::uint32_t c = 0; c < 3; ++c) {
        std::uint32_t& index = place[joined.root_of(3 * t + c)];
        if (index == kNone) {
          index = static_cast<std::uint32_t>(mesh.vertices_m.size());
          mesh.vertices_m.push_back(input_.vertices_m[triangles_[t][c]]);
          out_.split_vertices += known[triangles_[t][c]];
          known[triangles_[t][c]] = true;
        }
        mesh.triangles[t][c] = index;
      }
    mesh.materials = std::move(materials_);
  }

  // Unit vector from the middle of an edge into its face, perpendicular to the edge.
  Vec3 into_face(const Side& side) const {
    const Triangle& corners = triangles_[side.triangle];
    const Vec3 a = position(corners[side.corner]), b = position(corners[(side.corner + 1) % 3]),
               c = position(corners[(side.corner + 2) % 3]);
    const Vec3 along = (b - a) / length(b - a);
    const Vec3 into = (c - a) - along * dot(c - a, along);
    const double height_m = length(into);
    return height_m > 0 ? into / height_m : Vec3(0);
  }

  void find_edges() {
    for_each_edge(sides_, [&](std::size_t first, std::size_t last) {
      const Side& side = sides_[first];
      const auto edge = [&] {
        const Triangle& corners = out_.mesh.triangles[side.triangle];
        return MeshEdge{{corners[side.corner], corners[(side.corner + 1) % 3]},
                        side.triangle,
                        length(position(side.high) - position(side.low))};
      };
      if (last - first == 1) {
        out_.boundary_edges.push_back(edge());
      } else if (last - first > 2) {
        out_.feature_edges.push_back(edge());
      } else if (-dot(into_face(side), into_face(sides_[first + 1])) < kFeatureCosine) {
        out_.feature_edges.push_back(edge());
      }
    });
    const auto earlier = [](const MeshEdge& a, const MeshEdge& b) {
      return a.triangle != b.triangle ? a.triangle < b.triangle : a.vertices < b.vertices;
    };
    std::sort(out_.boundary_edges.begin(), out_.boundary_edges.end(), earlier);
    std::sort(out_.feature_edges.begin(), out_.feature_edges.end(), earlier);
  }

  Vec3 position(std::uint32_t vertex) const { return Vec3(input_.vertices_m[vertex]); }
  double area_of(const Triangle& corners) const {
    const Vec3 a = position(corners[0]);
    return 0.5 * length(cross(position(corners[1]) - a, position(corners[2]) - a));
  }
  Vec3 middle_of(const Triangle& corners) const {
    return (position(corners[0]) + position(corners[1]) + position(corners[2])) / 3.0;
  }

  const Mesh& input_;
  PreparedMesh out_;
  std::vector<Triangle> triangles_;  // input indices of the welded vertices
  std::vector<std::uint16_t> materials_;
  std::vector<Side> sides_;  // grouped by edge
};

}  // namespace

double area_m2(const Mesh& mesh, std::size_t triangle) {
  const auto& corners = mesh.triangles[triangle];
  const Vec3 a(mesh.vertices_m[corners[0]]);
  return 0.5 * length(cross(Vec3(mesh.vertices_m[corners[1]]) - a,
                            Vec3(mesh.vertices_m[corners[2]]) - a));
}

std::vector<std::uint32_t> sheets_of(const Mesh& mesh) {
  DisjointSets<std::uint32_t> sheets(mesh.vertices_m.size());
  for (const auto& triangle : mesh.triangles)
    for (const std::size_t c : {1, 2}) sheets.join(triangle[0], triangle[c]);
  return sheets.roots();
}

PreparedMesh prepare_mesh(const Mesh& mesh, const PreparationOptions& options) {
  assert(mesh.materials.size() == mesh.triangles.size());
  return Preparation(mesh, options).run();
}

}  // namespace clamor
