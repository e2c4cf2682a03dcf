// image_path.h: how much of an image source's sound arrives, by the path that it takes, and from
// where.
//
// mirror_path.h finds the path, and what hides it. The borders of all mirrors on the way diffract it
// (mirror_edges.h), also where the path is beside a mirror: a small one reflects little of a long
// wave, but that to all sides. The sound is the product of what each mirror makes of it, seen from
// the source's image before it and the listener's behind it, as if the others had no borders. That
// is right for one finite mirror among large ones; of two small ones, it lacks the sound that goes
// from border to border (tests/physics/plate_test.cpp). Which planes these mirrors have, the list of
// images tells (image_mirrors.h), or the place half way to an image that is in no list. In a corner,
// where sound meets the walls in either order, the order counts that the straight path has.
//
// Around the path of a single reflection, other edges diffract it as they do direct sound, also
// where it is hidden.
//
// Where a mirror ends without an edge, as it does where the material changes, and where obstacles
// hide a path with more reflections, an image fades: where its ends move across it, together and by
// up to kDiscRadius_m, a share of the paths is free, which is that of the amplitude. At the end of
// the mirror this is one half, as behind a half-plane.
//
// Both ends count alike, so that exchanging source and listener changes little
// (tests/physics/reciprocity_test.cpp).
//
// Movable parts reflect as the level does. An image in one of their faces (part_images.h) is
// reflected by parts alone, and one in the level by the level alone: where a door closes an opening
// of a wall, the two add up to the whole wall.
//
// Threads: any.   Cost: 7 paths of up to four rays, 19 at the edge of a mirror; where edges are
// near, up to 1600 rays and 1 ms more (mirror_edges.h).
#pragma once

#include <cstdint>

#include "formats/bake_file/source.h"
#include "runtime/occlusion/direct_sound.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

inline constexpr double kDiscRadius_m = 0.075;

// Returns the sound of an image that reaches the end of `line`, which begins at the image.
// Adds the rays cast to `rays`.
DirectSound image_sound(const OcclusionGeometry& geometry, const Source& image,
                        const LineOfSight& line, std::uint64_t& rays);

}  // namespace clamor
