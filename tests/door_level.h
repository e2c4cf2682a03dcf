// door_level.h: a level file of two rooms with a door in the doorway between them.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "formats/level/movable_part.h"
#include "tests/box_mesh.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {

inline constexpr float kDoorWall_m = 6;  // x of the wall between the rooms

// Two rooms of 6 by 5 m, and between them a wall without thickness, with a doorway of 0.9 x 2 m.
inline Mesh rooms_with_doorway() {
  Mesh mesh = box({12, 2.7, 5});
  const auto wall = [&](float low_y, float high_y, float low_z, float high_z) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
    for (const auto& [y, z] :
         {std::pair{low_y, low_z}, {high_y, low_z}, {high_y, high_z}, {low_y, high_z}})
      mesh.vertices_m.emplace_back(kDoorWall_m, y, z);
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
    mesh.materials.insert(mesh.materials.end(), 2, std::uint16_t{0});
  };
  wall(0, 2.7f, 0, 2.05f);
  wall(0, 2.7f, 2.95f, 5);
  wall(2, 2.7f, 2.05f, 2.95f);
  return mesh;
}

// Writes rooms.gltf and rooms.bin: the two rooms as node "Walls", and in their
// doorway the node "Door", closed, a leaf of 4 cm whose origin is its hinge. Neither is marked as
// movable.
inline std::string door_level(const Folder& folder) {
  Mesh leaf = box_mesh({0.02, 1, 0.45}, 0);
  for (Vec3f& vertex : leaf.vertices_m) vertex += Vec3f(0, 1, 0.45f);
  const auto text = [](auto number) { return std::to_string(number); };
  const auto list = [&](const Vec3f& v) {
    return "[" + text(v.x) + ", " + text(v.y) + ", " + text(v.z) + "]";
  };
  std::string bytes, views, accessors, meshes;
  const auto add_view = [&](const void* from, std::size_t size) {
    views += (views.empty() ? "" : ", ") + std::string(R"({"buffer": 0, "byteOffset": )") +
             text(bytes.size()) + R"(, "byteLength": )" + text(size) + "}";
    bytes.append(static_cast<const char*>(from), size);
  };
  int next = 0;  // view and accessor
  for (const Mesh& mesh : {rooms_with_doorway(), leaf}) {
    Vec3f low = mesh.vertices_m[0], high = low;
    for (const Vec3f& vertex : mesh.vertices_m)
      low = glm::min(low, vertex), high = glm::max(high, vertex);
    add_view(mesh.vertices_m.data(), mesh.vertices_m.size() * sizeof(Vec3f));
    add_view(mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
    const std::string comma = next == 0 ? "" : ", ";
    accessors += comma + R"({"componentType": 5126, "type": "VEC3", "bufferView": )" + text(next) +
                 R"(, "count": )" + text(mesh.vertices_m.size()) + R"(, "min": )" + list(low) +
                 R"(, "max": )" + list(high) +
                 R"(}, {"componentType": 5125, "type": "SCALAR", "bufferView": )" + text(next + 1) +
                 R"(, "count": )" + text(3 * mesh.triangles.size()) + "}";
    meshes += comma + R"({"primitives": [{"attributes": {"POSITION": )" + text(next) +
              R"(}, "indices": )" + text(next + 1) + R"(, "material": )" + text(next / 2) + "}]}";
    next += 2;
  }
  folder.write("rooms.bin", bytes);
  return folder.write("rooms.gltf",
                      R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
    "nodes": [{"name": "Walls", "mesh": 0},
              {"name": "Door", "mesh": 1, "translation": [6, 0, 2.05]}],
    "materials": [{"name": "plaster"}, {"name": "wood"}], "meshes": [)" +
                          meshes + R"(], "accessors": [)" + accessors + R"(], "bufferViews": [)" +
                          views + R"(], "buffers": [{"uri": "rooms.bin", "byteLength": )" +
                          text(bytes.size()) + "}]}");
}

}  // namespace clamor::testing
