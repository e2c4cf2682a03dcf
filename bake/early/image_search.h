// image_search.h: finds the image sources of emitters, by rays.
//
// Rays leave an emitter evenly in all directions and are reflected by mirrors, as often as the
// order says. Each reflection leads to an image, and rays that meet the same planes lead to the
// same one: what rays find is what a listener may hear, so that no path has to be tested against
// the 66 000 triangles of a level one by one. An image that few rays lead to is heard in a small
// part of the level only, or its mirror is a facet of a curved surface and smaller than the sound's
// wavelength; photons carry its sound, as that of all other paths.
//
// The result depends on the level alone, not on the seed or the number of threads.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/bake_file/image_source.h"

namespace clamor {

class Scene;
struct Level;

// The order for a level of so many emitters, if none is asked for: 3 for a few, 0 for a crowd.
int image_order_for(std::size_t emitters);

// Images of up to `order` reflections, at most kMaxImageOrder, by emitter. Costs 0.1 s of CPU for
// an emitter, and at most a few seconds for all.
std::vector<ImageSource> find_images(const Scene& scene, const Level& level, int order);

}  // namespace clamor
