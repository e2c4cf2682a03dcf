// texture_colour.h: the images of textures, and their mean colour and opacity, for displays that
// draw no textures and for the holes of alpha-masked surfaces.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/vec.h"
#include "formats/files/level_folder.h"
#include "formats/gltf/gltf_scene.h"

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

// The image of the texture that `index` names, or null. An image that needs an extension (KTX2,
// WebP) counts if the texture has no other.
const Json* texture_image(const Json& document, const Json* index);

// The means of an image of a scene: a file of the level, a data URI or a buffer view; nothing if it
// cannot be read.
std::optional<TextureMeans> image_means(const GltfScene& scene, const Json& image,
                                        LevelFolder& folder);

}  // namespace clamor
