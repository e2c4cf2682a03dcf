// box_level.h: a level file of a box, for tests that run the program.
#pragma once

#include <string>

#include "tests/box_mesh.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {

// Writes box.gltf and box.bin of a mesh, a minimal level with surfaces. `more`: members of the
// document, with a comma before each, and `of_primitive` of its one primitive.
inline std::string level_of(const Folder& folder, const Mesh& mesh, const std::string& more = "",
                            const std::string& of_primitive = "") {
  const std::size_t place_bytes = mesh.vertices_m.size() * sizeof(Vec3f);
  std::string bytes(reinterpret_cast<const char*>(mesh.vertices_m.data()), place_bytes);
  Vec3f low = mesh.vertices_m[0], high = low;
  for (const Vec3f& vertex : mesh.vertices_m)
    low = glm::min(low, vertex), high = glm::max(high, vertex);
  for (const auto& triangle : mesh.triangles)
    bytes.append(reinterpret_cast<const char*>(triangle.data()), sizeof triangle);
  folder.write("box.bin", bytes);
  const auto list = [](const Vec3f& v) {
    return "[" + std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z) +
           "]";
  };
  const std::string places = std::to_string(place_bytes);
  return folder.write(
      "box.gltf",
      R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1)" +
          of_primitive + R"(}]}], "accessors": [
      {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": )" +
          std::to_string(mesh.vertices_m.size()) + ", \"min\": " + list(low) +
          ", \"max\": " + list(high) +
          R"(}, {"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": )" +
          std::to_string(3 * mesh.triangles.size()) +
          R"(}], "bufferViews": [{"buffer": 0, "byteLength": )" + places +
          R"(}, {"buffer": 0, "byteOffset": )" + places +
          ", \"byteLength\": " + std::to_string(bytes.size() - place_bytes) +
          R"(}], "buffers": [{"uri": "box.bin", "byteLength": )" + std::to_string(bytes.size()) +
          "}]" + more + "}");
}

// A box of 4 x 3 x 5 m.
inline std::string box_level(const Folder& folder) { return level_of(folder, box({4, 3, 5})); }

}  // namespace clamor::testing
