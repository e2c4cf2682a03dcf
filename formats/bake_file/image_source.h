// image_source.h: an early specular path of an emitter, as the mirror image that it seems to come
// from.
//
// The image of a source in a plane is where the sound that the plane reflects as a mirror seems to
// come from; images of images are those of paths with more reflections (J. Allen, D. Berkley. Image
// Method for Efficiently Simulating Small-Room Acoustics. J. Acoust. Soc. Am. 65(4), 1979). An
// image stands for all paths that lead to it: in a corner, sound may meet the walls in either
// order, depending on where it is heard. The runtime finds out which path leads to a listener, if
// any (runtime/occlusion/image_path.h).
//
// Images are a list in the root of the file, not sources in its pages: an emitter has at most 512,
// only few emitters have any, and pages round positions to 4 mm, which is half a sample of delay.
#pragma once

#include <cstdint>

#include "common/vec.h"

namespace clamor {

inline constexpr int kMaxImageOrder = 3;  // reflections of a path

struct ImageSource {
  std::uint32_t emitter = 0;
  Vec3 position_m{};
  Vec3 axis{0, 0, -1};  // the emitter's, mirrored
};

// Images of an emitter that are so close together, for a path of this length, are one. The bound
// covers the rounding of corners in a bake file, which turns a plane of 5 m by 1 / 5000.
inline double image_tolerance_m(double path_m) { return 0.02 + 0.002 * path_m; }

}  // namespace clamor
