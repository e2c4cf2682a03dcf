// box_level.h: a level file of a box, for tests that run the program.
#pragma once

#include <string>

#include "tests/box_mesh.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {

// A box of 4 x 3 x 5 m, a minimal level with surfaces.
inline std::string box_level(const Folder& folder) {
  const Mesh mesh = box({4, 3, 5});
  std::string bytes(reinterpret_cast<const char*>(mesh.vertices_m.data()), 8 * sizeof(Vec3f));
  for (const auto& triangle : mesh.triangles)
    bytes.append(reinterpret_cast<const char*>(triangle.data()), sizeof triangle);
  folder.write("box.bin", bytes);
  return folder.write("box.gltf", R"({"asset": {"version": "2.0"}, "scene": 0,
    "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [
      {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 8,
       "min": [0, 0, 0], "max": [4, 3, 5]},
      {"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": 36}],
    "bufferViews": [{"buffer": 0, "byteLength": 96},
                    {"buffer": 0, "byteOffset": 96, "byteLength": 144}],
    "buffers": [{"byteLength": 240, "uri": "box.bin"}]})");
}

}  // namespace clamor::testing
