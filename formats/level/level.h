// level.h: a level as the bake needs it: triangles, materials, emitters and their signals.
//
// The import has merged the glTF file, its sidecar and the command line; a Level does not record
// which of them a value came from. Units are metres and seconds, axes right-handed with +Y up. All
// values are finite and in range.
#pragma once

#include <string>
#include <vector>

#include "common/air.h"
#include "common/material.h"
#include "formats/level/emitter.h"
#include "formats/level/mesh.h"
#include "formats/level/signal.h"

namespace clamor {

struct Level {
  std::string name;  // file name without its folder
  Mesh mesh;
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  std::vector<Signal> signals;
  Air air{};
};

}  // namespace clamor
