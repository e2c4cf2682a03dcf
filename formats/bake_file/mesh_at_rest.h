// mesh_at_rest.h: the surfaces of a bake file together with its movable parts at rest.
#pragma once

#include "common/result.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/geometry_section.h"
#include "formats/level/mesh.h"
#include "formats/level/movable_part.h"

namespace clamor {

// Reads the geometry, for measurements in which nothing moves.
inline Result<Mesh> read_mesh_at_rest(const BakeFile& file) {
  auto mesh = file.read_mesh();
  if (!mesh.ok()) return mesh;
  for (const MovablePart& part : file.movable_parts())
    append(placed(part.mesh, part.rest_pose), *mesh);
  return mesh;
}

}  // namespace clamor
