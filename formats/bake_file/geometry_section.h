// geometry_section.h: encodes the surfaces of a level in pages, for occlusion rays.
//
// A page holds up to 16384 triangles and their vertices in one zstd frame and decodes
// independently, in memory known beforehand. Vertices are quantized to millimetres above the lower
// corner of the whole geometry, so vertices shared by pages coincide. They are stored in order of
// first use, and corners as the distance to that position, which for neighbouring triangles gives
// small, repeating numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"
#include "common/vec.h"

namespace clamor {

struct Mesh;

inline constexpr std::uint32_t kPageTriangles = 16384;

struct GeometryCounts {
  std::uint32_t vertices = 0, triangles = 0;
};

struct PackedGeometryPage {
  GeometryCounts counts;
  std::vector<std::byte> frame;
};

struct PackedGeometry {
  Vec3 low_m{};
  std::vector<PackedGeometryPage> pages;
};

// The bytes are a function of the mesh alone. Unused vertices are dropped.
PackedGeometry pack_geometry(const Mesh& mesh);

// Returns whether a page of that size is plausible. A compression ratio above 1000 is considered a
// decompression bomb, which the writer never produces.
bool is_geometry_page(const GeometryCounts& counts, std::uint64_t packed_bytes);

// Decodes a page that passed is_geometry_page() and validates it. The Error is a predicate.
Result<Mesh> unpack_geometry_page(std::span<const std::byte> frame, const GeometryCounts& counts,
                                  const Vec3& low_m, std::size_t materials);

// Appends the triangles and vertices of a page.
void append(const Mesh& page, Mesh& mesh);

// Decodes the geometry of format 3.0: one frame with the columns x, y, z in millimetres and a, b, c
// as u32, and materials as u16.
Result<Mesh> unpack_whole_geometry(std::span<const std::byte> frame, const GeometryCounts& counts,
                                   const Vec3& low_m, std::size_t materials);

}  // namespace clamor
