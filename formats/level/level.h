// level.h: a level as the bake needs it: triangles, materials, emitters with their signals,
// probes, portals.
//
// The import has merged the glTF file, its sidecar and the command line; a Level does not record
// which of them a value came from. Units are metres and seconds, axes right-handed with +Y up. All
// values are finite and in range.
#pragma once

#include <string>
#include <vector>

#include "common/air.h"
#include "common/material.h"
#include "common/vec.h"
#include "formats/level/emitter.h"
#include "formats/level/mesh.h"
#include "formats/level/movable_part.h"
#include "formats/level/portal.h"
#include "formats/level/signal.h"

namespace clamor {

struct Level {
  std::string name;  // file name without its folder
  Mesh mesh;
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  std::vector<Signal> signals;
  Air air{};
  // Places where the bake traces what a source there would reflect, placed by hand.
  std::vector<Vec3> probes_m{};
  std::vector<MovablePart> movable_parts{};  // not in `mesh`; the bake does not trace them
  // Openings whose state the game sets; at most kMaxPortals.
  std::vector<Portal> portals{};
  std::vector<std::uint16_t> portal_materials{};  // of those that are baked closed, by portal
  Vec3 origin_m{};  // in the world's coordinates; all others are relative to it (level_origin.h)
};

}  // namespace clamor
