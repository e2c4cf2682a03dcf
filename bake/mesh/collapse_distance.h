// collapse_distance.h: how far a surface moves when one of its vertices goes.
//
// A fan of triangles round a vertex is replaced by the fan from one of its ring's points. Seen
// along the fan's mean normal both are heights over one polygon, linear but for the spokes; so
// their difference is greatest at the old centre or where an old spoke crosses a new one.
#pragma once

#include <optional>
#include <span>

#include "common/vec.h"

namespace clamor {

// Collapses `centre` onto ring[0]. A closed ring goes all round; an open one ends at ring.back(),
// and then the centre must lie on the line from there to ring[0]: it is moved there first.
//
// Returns the greatest distance between the old surface and the new, both ways, or nothing if a
// triangle would turn by more than 60 degrees against the mean normal, would come out thinner than
// `thin_m`, or none would be left.
std::optional<double> collapse_distance_m(const Vec3& centre, std::span<const Vec3> ring,
                                          bool closed, double thin_m);

}  // namespace clamor
