// mesh_preparation.h: from the triangles of a file to a surface that fits together.
//
// Exporters tear meshes apart: each face brings its own corners, instances are rounded apart,
// objects are copied onto themselves. Here corners that single precision or a hundredth of the
// smallest wavelength cannot tell apart become one, so that neighbours share them exactly and no
// ray slips between; triangles without area go; of faces that coincide the first in the file stays,
// so that which of their materials is met is no accident; and where three or more faces meet at an
// edge, or two cones at a point, each sheet gets its own copy of the vertex, so that what is left
// is a manifold, as OpenMesh wants it. No triangle is turned round: surfaces reflect on both sides.
//
// A function of the mesh alone. Time grows as n log n for any input: a million triangles take about
// a second.   Memory: about 200 bytes per triangle while it works.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/level/level.h"

namespace clamor {

struct PreparationOptions {
  double weld_m = 0;  // corners nearer than this become one; 0: weld_distance_m()
};

// An edge of a mesh that sound bends round or leaks past.
struct MeshEdge {
  std::array<std::uint32_t, 2> vertices{};
  std::uint32_t triangle = 0;  // the first that it belongs to
  double length_m = 0;
};

// Faces that coincided although their materials differ.
struct MaterialClash {
  std::uint16_t kept = 0, dropped = 0;
  std::size_t faces = 0;  // dropped
  double area_m2 = 0;     // of these
};

struct PreparedMesh {
  Mesh mesh;

  // Per triangle: 1 if it must be turned round to face as its neighbours do. Nothing is turned.
  std::vector<std::uint8_t> turned;

  double weld_m = 0;                // what was used
  std::size_t welded_vertices = 0;  // corners that became another's
  std::size_t degenerate = 0;       // triangles without area, before or after welding
  std::size_t duplicated = 0;       // triangles with the corners of an earlier one
  double degenerate_m2 = 0, duplicated_m2 = 0;
  std::vector<MaterialClash> clashes;  // by area, largest first
  std::size_t split_edges = 0;         // where three or more faces met, or a strip closes twisted
  std::size_t split_vertices = 0;      // copies made

  std::vector<MeshEdge> boundary_edges;  // of one face
  std::vector<MeshEdge> feature_edges;   // folded by more than kFeatureAngle, or of three faces
};

// Octagonal columns have edges, twelve-sided ones are round: sound is diffracted by folds sharper
// than 35 degrees. The cosine, so that no library's arc cosine decides.
inline constexpr double kFeatureCosine = 0.8191520442889918;

// A tenth of a millimetre: a three-hundredth of the shortest wavelength, but no more than 1e-5 of
// the level's extent, which is how far Scene keeps rays off surfaces and so all that they resolve;
// and no less than four steps of single precision at the largest coordinate, which is what
// transforms round apart.
double weld_distance_m(const Mesh& mesh);

PreparedMesh prepare_mesh(const Mesh& mesh, const PreparationOptions& options = {});

double area_m2(const Mesh& mesh, std::size_t triangle);

// Per vertex, one vertex of the sheet (triangles joined by shared vertices) that it is of.
std::vector<std::uint32_t> sheets_of(const Mesh& mesh);

}  // namespace clamor
