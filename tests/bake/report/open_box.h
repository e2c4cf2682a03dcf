// open_box.h: a shoebox without one of its walls.
#pragma once

#include "formats/level/level.h"
#include "tests/rooms.h"

namespace clamor::testing {

enum Wall { kLeft, kRight, kFloor, kCeiling, kBack, kFront };

inline Level without(Wall wall, const Vec3& size_m, float absorption, const Vec3& emitter_m) {
  Level level = shoebox(size_m, uniform_material(absorption), emitter_m);
  level.mesh.triangles.erase(level.mesh.triangles.begin() + 2 * wall,
                             level.mesh.triangles.begin() + 2 * wall + 2);
  level.mesh.materials.resize(10);
  return level;
}

}  // namespace clamor::testing
