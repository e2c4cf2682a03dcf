// texture_colour.h: the mean colour and opacity of a texture, for displays that draw no textures,
// and for the holes of alpha-masked surfaces.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/vec.h"

namespace clamor {

// All from 0 to 1.
struct TextureMeans {
  std::optional<Vec3f> colour;  // linear; transparent pixels count less, and some must be opaque
  double alpha = 1;
  double clear_share = 0;  // share of the pixels that are fully transparent
};

// The means of a PNG or JPEG file. Nothing if it cannot be decoded, or the program was built with a
// tinygltf that decodes no images.
std::optional<TextureMeans> texture_means(std::span<const std::byte> image);

}  // namespace clamor
