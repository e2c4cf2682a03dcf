// path_over_edges.h: where the shortest path over two edges passes them.
//
// The length of the path is a convex function of the two places on the edges, and Newton's method
// finds its least value within the edges' ends. From either end of the path the places are the
// same, to a millimetre.
//
// Threads: any.   Cost: half a microsecond.
#pragma once

#include <array>

#include "common/vec.h"
#include "runtime/occlusion/edge_in_air.h"

namespace clamor {

// The z of either edge on the way over `first` and then `second`.
std::array<double, 2> path_over_edges(const EdgeInAir& first, const EdgeInAir& second,
                                      const Vec3& from_m, const Vec3& to_m);

}  // namespace clamor
