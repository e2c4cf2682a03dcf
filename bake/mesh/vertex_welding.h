// vertex_welding.h: merges nearby vertices.
//
// Vertices are processed in file order. Each one joins the nearest earlier representative within
// the welding distance, or else becomes a representative itself. Representatives therefore keep
// their positions, chains of small steps never merge distant vertices, and any two representatives
// are further apart than the welding distance. A grid cell holds few of them, so each lookup is
// bounded for any input.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/level/mesh.h"

namespace clamor {

struct Welding {
  // Per vertex; vertices without triangles represent themselves.
  std::vector<std::uint32_t> representative;
  std::size_t welded = 0;  // used vertices represented by another vertex
};
Welding weld_vertices(const Mesh& mesh, double distance_m);

}  // namespace clamor
