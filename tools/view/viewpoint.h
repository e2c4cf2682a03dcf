// viewpoint.h: where to stand so that a place of a level is seen.
#pragma once

#include <span>

#include "common/listener.h"
#include "common/vec.h"
#include "formats/level/mesh.h"

namespace clamor {

// A listener who looks at a place of `size_m` from where nothing hides it, if possible in sight of
// the first of `inside_m` (up to four), such as emitters: the place may be a hole, which has an
// outside, too. Linear in the number of triangles: a click has time.
Listener viewpoint_of(const Mesh& mesh, const Vec3& place_m, double size_m,
                      std::span<const Vec3> inside_m);

// A listener at `from_m` who looks at a place.
Listener looking_at(const Vec3& from_m, const Vec3& place_m);

}  // namespace clamor
