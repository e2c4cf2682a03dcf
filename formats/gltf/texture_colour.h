// texture_colour.h: the mean colour of a texture, for displays that draw no textures.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/vec.h"

namespace clamor {

// The mean of a PNG or JPEG file, linear, each channel from 0 to 1; transparent pixels count less.
// Nothing if it cannot be decoded, or the program was built with a tinygltf that decodes no images.
std::optional<Vec3f> mean_colour(std::span<const std::byte> image);

}  // namespace clamor
