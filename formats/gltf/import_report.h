// import_report.h: what the import of a level found, and how it understood it.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "formats/level/surface_rules.h"

namespace clamor {

// Origin of the acoustic values of a material of the level.
struct MaterialAssignment {
  std::string material;  // its name in the level
  std::string preset;    // assigned preset, empty for explicit values
  std::string
      how;  // "CLAMOR_materials_acoustic", "extras", "sidecar 'brick*'", "name", "doubt", "default"
  std::size_t triangles = 0;
  double area_m2 = 0;
};

// Triangles of a level's mesh, which come from one node.
struct NamedTriangles {
  std::size_t first = 0, end = 0;
  std::vector<std::string> nodes;  // its name, then those of the nodes above it
};

struct ImportReport {
  // Meshes and materials that are no surfaces, by their NoSurface.
  std::array<std::size_t, kNoSurfaceReasons> left_out{};
  std::vector<MaterialAssignment> materials;
  std::vector<std::string> found;     // "66454 triangles in 12 meshes on 14 nodes"
  std::vector<std::string> ignored;   // "2 cameras", "textures", "distance model 'linear' of ..."
  std::vector<std::string> warnings;  // problems for the user to check
};

}  // namespace clamor
