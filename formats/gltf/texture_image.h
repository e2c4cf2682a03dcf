// texture_image.h: finds and reads the images of the textures of a glTF document.
#pragma once

#include <optional>
#include <span>

#include "formats/files/json.h"
#include "formats/files/level_folder.h"

namespace clamor {

// The image of the texture that `index` names, or null. An image that needs an extension (KTX2,
// WebP) counts if the texture has no other.
const Json* texture_image(const Json& document, const Json* index);

// The bytes of an image: a file of the level, a data URI or a buffer view; nothing if that fails.
std::optional<FileBytes> read_image(const Json& document, std::span<const FileBytes> buffers,
                                    const Json& image, LevelFolder& folder);

}  // namespace clamor
