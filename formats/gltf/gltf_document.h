// gltf_document.h: reads the container of a glTF file: its JSON and buffers.
//
// Everything that could break later stages is an Error here, before tinygltf sees the document:
// unknown extensions that may change geometry, wrong types, indices out of range, truncated
// buffers, views outside their buffers. Compressed geometry is left as it is (gltf_compression.h).
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/files/json.h"
#include "formats/files/level_folder.h"

namespace clamor {

struct GltfDocument {
  Json json;
  std::vector<FileBytes> buffers;       // a fallback of compressed views may be empty
  std::map<std::size_t, double> steps;  // of accessors whose numbers compression has rounded
};

// Recognises .glb by its first bytes, whatever the extension. Buffers are read through `folder`.
// `ignored_extensions` may be required, whatever they change (required_extensions.h).
Result<GltfDocument> read_gltf_document(const std::string& path, LevelFolder& folder,
                                        std::span<const std::string> ignored_extensions = {});

}  // namespace clamor
