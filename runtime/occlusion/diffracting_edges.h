// diffracting_edges.h: the edges of surfaces that diffract sound: borders of thin walls, and
// corners that point into the air.
//
// Surfaces are two-sided and have no inside, so an edge diffracts where the air around it covers an
// angle of more than 180 degrees between two neighbouring faces: 360 at the border of a single
// sheet, 270 at the corner of a box.
//
// Threads: any; nothing changes after the constructor.
// Memory: 80 bytes per edge.
// Cost: building takes 1 s for a million triangles; a search 0.1 ms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/vec.h"
#include "formats/level/mesh.h"
#include "runtime/occlusion/box_tree.h"

namespace clamor {

struct MirrorPlane;  // mirror_plane.h

inline constexpr double kOnPlane_m = 0.01;  // covers the rounding of corners in a bake file

// A straight edge with air around it from one face to the other. Angles are measured around the
// edge from the first face through the air.
struct DiffractingEdge {
  Vec3f from_m{}, to_m{};
  Vec3f along{};      // unit, from from_m to to_m
  Vec3f face{};       // unit, along the first face, at a right angle to the edge
  Vec3f air{};        // unit, at a right angle to both, into the air
  float air_rad = 0;  // from the first face to the second, in (180, 360] degrees
  // The width of the narrow face between the two corners at the end of a wall; infinite elsewhere.
  float width_m = std::numeric_limits<float>::infinity();
  // To long waves, the end of a wall is the border of a sheet: an edge of its own in the middle of
  // the narrow face.
  bool is_sheet = false;
  bool is_post = false;  // one of four such sheets, in both directions of a rectangular post
  // Whether the edge may go on as its mirror image beyond from_m and to_m (edge_diffraction.h).
  bool goes_on_before = true, goes_on_beyond = true;

  // Angle of a point, from 0 to 360 degrees; above air_rad it is behind the faces.
  double angle_rad(const Vec3& point_m) const;
  // The same, but on the nearer face for points behind the faces.
  double angle_in_air_rad(const Vec3& point_m) const;
  bool is_in_air(const Vec3& point_m) const;
  bool is_on_face(const Vec3& point_m) const;
  bool is_in(const MirrorPlane& plane) const;
  // Returns whether the points are on different sides of the plane of a face.
  bool is_between(const Vec3& a_m, const Vec3& b_m) const;
};

// Two points in cylindrical coordinates around an edge; z is 0 at the edge's from_m.
struct PointsAroundEdge {
  PointsAroundEdge(const DiffractingEdge& edge, const Vec3& from_m, const Vec3& to_m);

  // Where the shortest path over the edge's line crosses it.
  double apex_m() const;
  // Length of the path over the edge at z.
  double path_m(double z) const;
  // Whether a point is on the edge's line, where angles mean nothing.
  bool is_singular() const { return !(r_from_m > 1e-6 && r_to_m > 1e-6); }

  double z_from_m, z_to_m, r_from_m, r_to_m;
};

// An edge between two points, and how much longer the shortest path over it is than the straight
// line.
struct EdgeBetween {
  double detour_m = 0;
  DiffractingEdge edge;
};

// A point so near to the plane of a face is in the air before it, whatever the rounding.
inline constexpr double kTie_rad = 3e-6;

class DiffractingEdges {
 public:
  DiffractingEdges() = default;
  explicit DiffractingEdges(const Mesh& mesh);

  std::size_t size() const { return edges_.size(); }
  const DiffractingEdge& operator[](std::size_t i) const { return edges_[i]; }

  // Appends the edges with the shortest detours between two points to `found`, at most `count` and
  // none longer than `longest_m`, of those that are between the points. In the order of detours.
  // With a plane, only edges that lie in it.
  void find_nearest(const Vec3& from_m, const Vec3& to_m, std::size_t count, double longest_m,
                    std::vector<EdgeBetween>& found, const MirrorPlane* plane = nullptr) const;

 private:
  void add_ends_of_walls();

  std::vector<DiffractingEdge> edges_;
  BoxTree tree_;
};

}  // namespace clamor
