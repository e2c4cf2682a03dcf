// image_path.h: how much of an image source's power arrives, by the path that the sound takes.
//
// From the listener towards the image, the first surface is the last mirror of the path, if there
// is a path at all. The image's own image in that mirror is where the path goes on, and so back to
// the source itself. Which mirrors these are, the walk finds out: an image behind a corner is heard
// by one order of reflections here and by another there.
//
// At the edge of a mirror an image does not vanish at once: a disc of kDiscRadius_m around the
// listener, across the straight line, sees a share of it, which is that of the amplitude. At the
// edge itself this is one half, as behind a half-plane.
//
// Threads: any.   Cost: 7 paths of up to four rays, 19 at the edge of a mirror.
#pragma once

#include <cstdint>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

inline constexpr double kDiscRadius_m = 0.15;

// Share of the power of `image`, per band, that mirrors reflect to `place`, and that no surface
// hides on its way. Adds the rays cast to `rays`.
Bands image_visibility(const OcclusionGeometry& geometry, const Source& image, const Vec3& place,
                       std::uint64_t& rays);

}  // namespace clamor
