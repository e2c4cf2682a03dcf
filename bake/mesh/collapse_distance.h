// collapse_distance.h: upper bound of how far an edge collapse moves a surface.
//
// A collapse replaces the fan of triangles around a vertex by the fan from one point of its ring.
// Projected along the fan's mean normal, both fans are piecewise linear height fields over the same
// polygon. Their difference is therefore largest at the old centre or where an old spoke crosses a
// new one.
#pragma once

#include <optional>
#include <span>

#include "common/vec.h"

namespace clamor {

// Collapses `centre` onto ring[0]. A closed ring goes all the way around. An open ring ends at
// ring.back(); its centre must lie on the line from there to ring[0] and is first moved onto that
// line.
//
// Returns the two-sided Hausdorff distance between the old surface and the new one. Returns nothing
// if a triangle would turn by more than 60 degrees against the mean normal or become thinner than
// `thin_m`, or if no triangle would remain.
std::optional<double> collapse_distance_m(const Vec3& centre, std::span<const Vec3> ring,
                                          bool closed, double thin_m);

}  // namespace clamor
