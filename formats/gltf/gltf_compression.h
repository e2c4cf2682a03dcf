// gltf_compression.h: unpacks compressed geometry, so that the other stages see plain views.
//
//   EXT_meshopt_compression, KHR_meshopt_compression   buffer views  (meshopt_codec.h)
//   KHR_draco_mesh_compression                         primitives    (draco_codec.h)
//
// What a level holds uncompressed as well, as a fallback, is read from there. Attributes that only
// a renderer reads are not unpacked.
#pragma once

#include "common/result.h"
#include "formats/gltf/gltf_scene.h"

namespace clamor {

// Appends buffers, and lets views, accessors and primitives refer to them; the document stays as it
// is. Afterwards a buffer view is empty if its buffer is a fallback that is not there and nobody
// reads it.
Result<void> unpack_geometry(GltfScene& scene);

}  // namespace clamor
