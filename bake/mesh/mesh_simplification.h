// mesh_simplification.h: removes triangles whose loss is inaudible.
//
// Vertices are removed by half-edge collapses in order of quadric error (M. Garland, P. Heckbert,
// SIGGRAPH 1997), so the remaining vertices are a subset of the original ones. OpenMesh preserves
// the topology: no surface is torn open and no hole is closed.
//
// The Hausdorff distance between input and result stays within the tolerance. Each collapse has an
// exact local distance (collapse_distance.h), and each triangle carries the sum of the distances of
// all collapses that led to it. (Compare A. Guéziec, Surface simplification with variable
// tolerance, 1995; here the sums run over time only.)
//
// Boundaries, feature edges and material borders are constraint lines: a vertex on a line may only
// move along it, within the same tolerance, and vertices where lines meet or end are fixed. Where
// the edge of one piece touches or nearly touches another, both are fixed, so that no crack opens.
// No triangle turns by more than 60 degrees.
//
// The result depends on the input alone. OpenMesh is used in this module only. Memory:
// about 1 kB per triangle.
#pragma once

#include <cstddef>

#include "bake/mesh/mesh_preparation.h"

namespace clamor {

struct Simplification {
  Mesh mesh;
  double error_m = 0;  // upper bound of the Hausdorff distance to the input
};

// Requires tolerance_m > 0.
Simplification simplify(const PreparedMesh& prepared, double tolerance_m);

}  // namespace clamor
