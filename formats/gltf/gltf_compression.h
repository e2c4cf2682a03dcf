// gltf_compression.h: unpacks compressed geometry, so that the other stages see a plain document.
//
//   EXT_meshopt_compression, KHR_meshopt_compression   buffer views  (meshopt_codec.h)
//   KHR_draco_mesh_compression                         primitives    (draco_codec.h)
//
// What a level holds uncompressed as well, as a fallback, is read from there. Attributes that only
// a renderer reads are not unpacked.
#pragma once

#include "common/result.h"
#include "formats/gltf/gltf_document.h"

namespace clamor {

// Appends buffers, and refers to them from the document. Afterwards a buffer view is empty if its
// buffer is a fallback that is not there and nobody reads it. The document must be checked
// (gltf_check.h).
Result<void> unpack_geometry(GltfDocument& document);

}  // namespace clamor
