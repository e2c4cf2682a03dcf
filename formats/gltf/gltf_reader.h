// gltf_reader.h: a glTF document made plain structs. tinygltf is visible only here.
#pragma once

#include <string>

#include "common/result.h"
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/gltf_scene.h"

namespace clamor {

// tinygltf reads the structure from the essential parts of the checked document, with file
// callbacks that refuse everything: it never sees a URI, an image or a buffer.
Result<GltfScene> read_gltf_scene(GltfDocument document);

}  // namespace clamor
