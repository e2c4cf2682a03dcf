// draco_codec.h: decodes primitives that KHR_draco_mesh_compression compressed. Draco is visible
// only here.
//
// Draco follows untrusted streams out of bounds (github.com/google/draco, issue 1102, pull request
// 1197) and allocates what they ask for (issue 1169), so all primitives of a level are decoded in
// one child process. Its memory and time are limited in proportion to the sizes that the level
// states, which in turn are limited in proportion to its bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/files/level_folder.h"

namespace clamor {

struct DracoAttribute {
  std::uint32_t id = 0;    // the unique id in the stream
  int component_type = 0;  // of its accessor, 5120 to 5126
  int components = 0;      // 1 to 4

  auto operator<=>(const DracoAttribute&) const = default;
};

struct DracoPrimitive {
  std::string name;  // for messages
  std::span<const std::byte> stream;
  std::vector<DracoAttribute> attributes;  // that are read
  std::uint64_t stated_elements = 0;       // vertices and indices, as the accessors say
};

// Offsets are those of DecodedDraco::bytes. Elements are tightly packed.
struct DracoGeometry {
  std::size_t vertices = 0, indices = 0;  // counts; three 32-bit indices are a triangle
  std::size_t index_offset = 0;
  std::vector<std::size_t> attribute_offsets;  // in the order of DracoPrimitive::attributes
  std::vector<double> steps;  // of quantised positions, the distance of neighbouring values; else 0
};

struct DecodedDraco {
  FileBytes bytes;
  std::vector<DracoGeometry> geometries;  // in the order of the primitives
};

// `level_bytes`: of all buffers, however many primitives share a stream.
//
// Indices may be out of range. Component types must be known (component_bytes()). Errors: a damaged
// stream, an attribute that it does not hold, more memory or time than the limits, a crash; a build
// without Draco.
Result<DecodedDraco> decode_draco(std::span<const DracoPrimitive> primitives,
                                  std::size_t level_bytes);

}  // namespace clamor
