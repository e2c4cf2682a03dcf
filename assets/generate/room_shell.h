// room_shell.h: the six walls of a box-shaped room, with recessed windows and doors, without gaps.
//
// All six are cut along the same planes, so every edge of the shell is shared by exactly two
// triangles: no photon finds a way out.
#pragma once

#include <functional>
#include <vector>

#include "mesh_builder.h"

namespace clamor::assets {

enum class Side { kFloor, kCeiling, kLeft, kRight, kFront, kBack };  // -y +y -x +x -z +z

struct Cell {
  MaterialIndex material;
  double recess_m = 0;  // how far outside the wall's plane
  bool operator==(const Cell&) const = default;
};

// Planes to cut along, ascending; the first and last are the room's walls.
struct ShellGrid {
  std::vector<double> x_m, y_m, z_m;
};

// The properties of a wall at a point.
using WallPlan = std::function<Cell(Side side, const Vec3& middle_m)>;

MeshBuilder make_shell(const ShellGrid& grid, MaterialIndex reveal, const WallPlan& plan);

}  // namespace clamor::assets
