// geometry_section.h: the level's surfaces in a bake file, for visibility rays, in pages.
//
// A page is up to 16384 triangles with vertices of their own, in one zstd frame, so each decodes
// alone, in memory that is known before. Vertices are in whole millimetres above the low corner of
// the whole geometry, so those that two pages share are in the same place. They stand in the order
// in which triangles first name them, and corners are told by how long ago that was: of neighbours
// these are small numbers that repeat.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"
#include "formats/level/level.h"

namespace clamor {

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

// The bytes are a function of the mesh alone. Vertices that no triangle names are left out.
PackedGeometry pack_geometry(const Mesh& mesh);

// Whether there can be a page of so many packed bytes. One that would unpack to more than 1000
// times its size is taken for a bomb; the writer makes none.
bool is_geometry_page(const GeometryCounts& counts, std::uint64_t packed_bytes);

// A page for which that is so. Corners and materials are checked. An Error is half a sentence.
Result<Mesh> unpack_geometry_page(std::span<const std::byte> frame, const GeometryCounts& counts,
                                  const Vec3& low_m, std::size_t materials);

// Adds the triangles and vertices of a page to those of the pages before.
void append(const Mesh& page, Mesh& mesh);

// What files of format 3.0 have instead: one frame of the vertices' columns x, y, z in u32
// millimetres, the corners' a, b, c as u32 and materials as u16.
Result<Mesh> unpack_whole_geometry(std::span<const std::byte> frame, const GeometryCounts& counts,
                                   const Vec3& low_m, std::size_t materials);

}  // namespace clamor
