// gltf_reader.h: unpacks a glTF document and converts it to plain structs. tinygltf is visible only
// here.
#pragma once

#include <optional>
#include <string>

#include "common/result.h"
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_scene.h"

namespace clamor {

// tinygltf parses only the essential parts of the checked document, with file callbacks that always
// fail: it never sees a URI, an image or a buffer. `wanted` is the name or number of a scene
// (gltf_scenes.h).
Result<GltfScene> read_gltf_scene(GltfDocument document,
                                  const std::optional<std::string>& wanted = {});

}  // namespace clamor
