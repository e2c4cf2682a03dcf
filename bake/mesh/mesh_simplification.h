// mesh_simplification.h: fewer triangles where sound does not hear the difference.
//
// Vertices are taken away one by one, the flattest first (quadric error: M. Garland, P. Heckbert,
// SIGGRAPH 1997), each collapsed onto a neighbour, so that what is left is a subset of the vertices
// there were. OpenMesh keeps the topology: nothing is torn open, no hole is closed.
//
// The result stays within the tolerance of the input, and the input within it of the result. That
// is kept as a bound, not as a hope: where a vertex goes, the surface about it before and after are
// both heights over one polygon, so the greatest distance between them is found at finitely many
// points, and each triangle carries the sum of such distances of all that it came from (as in
// A. Guéziec, Surface simplification with variable tolerance, 1995, but sums over time only).
//
// Boundaries, features and borders of materials are lines of their own: a vertex on one may go only
// along it, by the same tolerance; where such lines meet or end, vertices stay. Where the edge of
// one piece touches another, or nearly, both stay as they are: no crack opens. No triangle turns by
// more than 60 degrees.
//
// A function of its input alone. OpenMesh ends here. Memory: about 1 kB per triangle while it
// works.
#pragma once

#include <cstddef>

#include "bake/mesh/mesh_preparation.h"

namespace clamor {

struct Simplification {
  Mesh mesh;
  double error_m = 0;  // bound on the distance to the input, both ways
};

// `tolerance_m` > 0.
Simplification simplify(const PreparedMesh& prepared, double tolerance_m);

}  // namespace clamor
