// gltf_document.h: reads the container of a glTF file: its JSON and buffers.
//
// Everything that could break later stages is an Error here: unknown extensions that may change
// geometry, wrong types, indices out of range, truncated buffers, views outside their buffers.
// Compressed geometry is left as it is (gltf_compression.h).
#pragma once

#include <span>
#include <string>

#include "common/result.h"
#include "formats/files/level_folder.h"
#include "formats/gltf/gltf_scene.h"

namespace clamor {

// Recognises .glb by its first bytes, whatever the extension. Buffers are read through `folder`.
// `ignored_extensions` may be required, whatever they change (required_extensions.h). No scene is
// chosen yet (gltf_scenes.h).
Result<GltfScene> read_gltf_document(const std::string& path, LevelFolder& folder,
                                     std::span<const std::string> ignored_extensions = {});

}  // namespace clamor
