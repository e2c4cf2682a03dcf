// mesh_preparation.h: turns the triangles of a file into a clean manifold mesh.
//
// Exporters tear meshes apart: each face has its own vertices, instances differ by rounding,
// objects are copied onto themselves. Preparation does four things. It welds vertices that single
// precision or a hundredth of the shortest wavelength cannot distinguish, so that neighbours share
// them exactly and no ray slips between. It removes triangles without area. Of coinciding faces it
// keeps the first in the file, so that their material is well defined. Where three or more faces
// meet at an edge, or two cones at a point, it gives each sheet a vertex of its own, because
// OpenMesh expects a manifold. No triangle is flipped: surfaces reflect on both sides.
//
// The result depends on the mesh alone. Time is O(n log n) for any input, about one second for a
// million triangles. Memory: about 200 bytes per triangle.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/level/mesh.h"

namespace clamor {

struct PreparationOptions {
  double weld_m = 0;      // welding distance; 0: weld_distance_m()
  double rounding_m = 0;  // how far the rounding of quantised positions may have parted vertices
};

// An edge that sound is diffracted around or leaks through.
struct MeshEdge {
  std::array<std::uint32_t, 2> vertices{};
  std::uint32_t triangle = 0;  // the first triangle with this edge
  double length_m = 0;
};

// Coinciding faces of different materials.
struct MaterialClash {
  std::uint16_t kept = 0, dropped = 0;
  std::size_t faces = 0;  // number of dropped faces
  double area_m2 = 0;     // area of the dropped faces
  Vec3 place_m{};         // middle of the largest of them
};

struct PreparedMesh {
  Mesh mesh;

  // Per triangle: 1 if its winding is opposite to its neighbours'. The mesh itself keeps its
  // winding.
  std::vector<std::uint8_t> turned;

  double weld_m = 0;                // welding distance used
  std::size_t welded_vertices = 0;  // vertices merged into another
  std::size_t degenerate = 0;       // triangles without area, before or after welding
  std::size_t duplicated = 0;       // triangles with the vertices of an earlier one
  double degenerate_m2 = 0, duplicated_m2 = 0;
  std::vector<MaterialClash> clashes;  // largest area first
  std::size_t split_edges = 0;         // edges of three or more faces, and closed twisted strips
  std::size_t split_vertices = 0;      // vertices duplicated

  std::vector<MeshEdge> boundary_edges;  // edges of one face
  // Edges folded by more than the feature angle, or of three or more faces.
  std::vector<MeshEdge> feature_edges;
};

// Cosine of the feature angle, 35 degrees: sharper folds diffract sound. Octagonal columns then
// have edges and twelve-sided ones are round. The constant is a cosine, so that no library's acos
// decides.
inline constexpr double kFeatureCosine = 0.8191520442889918;

// Default welding distance: 0.1 mm, a three-hundredth of the shortest wavelength. At most 1e-5 of
// the level's extent, which is Scene's ray offset and so the resolution of rays; at least four
// units in the last place of the largest coordinate, the rounding error of transforms; and at least
// the rounding of quantised positions, unless that exceeds kMaxRounding_m.
inline constexpr double kMaxRounding_m = 0.005;  // an eighth of the shortest wavelength
double weld_distance_m(const Mesh& mesh, double rounding_m = 0);

PreparedMesh prepare_mesh(const Mesh& mesh, const PreparationOptions& options = {});

double area_m2(const Mesh& mesh, std::size_t triangle);

// Connected components: per vertex, the representative vertex of its sheet (triangles joined by
// shared vertices).
std::vector<std::uint32_t> sheets_of(const Mesh& mesh);

}  // namespace clamor
