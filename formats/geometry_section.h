// geometry_section.h: a level's triangles in a bake file, for visibility rays.
//
// Vertices in whole millimetres from the low corner, as u32 columns x, y, z; then corners as u32
// columns a, b, c; then material indices as u16; one zstd frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"
#include "formats/level.h"

namespace clamor {

struct GeometryCounts {
  Vec3 low_m{};
  std::uint32_t vertices = 0, triangles = 0;
};

std::vector<std::byte> pack_geometry(const Mesh& mesh, GeometryCounts& counts);

// Corners and materials are checked. A frame that would unpack to more than 1000 times its size is
// taken for a bomb: real levels pack 2 to 50 times.
Result<Mesh> unpack_geometry(std::span<const std::byte> frame, const GeometryCounts& counts,
                             std::size_t materials);

}  // namespace clamor
