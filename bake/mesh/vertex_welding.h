// vertex_welding.h: which vertices are one.
//
// Vertices are taken in the order of the file. Each joins the nearest one before it that stands for
// itself and is near enough, or else stands for itself. So those that stay keep their place, no
// chain of small steps joins what is far apart, and any two that stay are further apart than the
// distance: few fit into a cell of a grid, so each look-up is bounded whatever the input.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/level/level.h"

namespace clamor {

struct Welding {
  std::vector<std::uint32_t> representative;  // per vertex; of those that no triangle uses, itself
  std::size_t welded = 0;                     // used vertices that are represented by another
};
Welding weld_vertices(const Mesh& mesh, double distance_m);

}  // namespace clamor
