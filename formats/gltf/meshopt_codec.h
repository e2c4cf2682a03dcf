// meshopt_codec.h: unpacks a buffer view that EXT_meshopt_compression or KHR_meshopt_compression
// compressed. libmeshoptimizer is visible only here.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "common/result.h"
#include "formats/files/level_folder.h"

namespace clamor {

// A byte of a vertex stream tells of at most 4 x 256 bytes; index streams are less dense.
inline constexpr std::size_t kMaxUnpackedPerByte = 1024;

struct MeshoptView {
  std::string mode;             // ATTRIBUTES, TRIANGLES or INDICES
  std::string filter = "NONE";  // OCTAHEDRAL, QUATERNION or EXPONENTIAL
  std::size_t count = 0;        // elements, at most 1e15
  std::size_t stride = 0;       // bytes of an element
};

// Returns count * stride bytes. The library holds against untrusted streams, within the memory that
// a stream of this size can fill, but indices may be out of range.
//
// Errors: a mode, filter or stride that the extensions do not define; a stream that is damaged, cut
// short or newer than the library; a build without libmeshoptimizer.
Result<FileBytes> decode_meshopt(const MeshoptView& view, std::span<const std::byte> stream);

}  // namespace clamor
