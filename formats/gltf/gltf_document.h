// gltf_document.h: the container of a glTF file: JSON, buffers, and whether we can read it at all.
//
// Everything that a reader may stumble over is refused here, before tinygltf sees the document:
// extensions that change geometry, wrong types, indices out of range, buffers shorter than they
// say, views outside their buffers.
#pragma once

#include <string>
#include <vector>

#include "common/result.h"
#include "formats/files/json.h"
#include "formats/level/level_folder.h"

namespace clamor {

struct GltfDocument {
  Json json;
  std::vector<FileBytes> buffers;
};

// `path` ends in anything: a .glb is known by its first bytes. Buffers are read through `folder`.
Result<GltfDocument> read_gltf_document(const std::string& path, LevelFolder& folder);

}  // namespace clamor
