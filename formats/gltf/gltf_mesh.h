// gltf_mesh.h: the triangles of a glTF scene, in the world.
#pragma once

#include <cstdint>
#include <vector>

#include "common/result.h"
#include "formats/gltf/gltf_placement.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/level/level.h"

namespace clamor {

inline constexpr std::uint64_t kMaxTriangles = 200'000'000;

struct SceneMesh {
  // Mesh::materials holds indices of glTF materials here; a primitive without one has the index
  // after the last.
  Mesh mesh;
  std::size_t meshes = 0, placements = 0;  // that triangles came from
  std::size_t hidden = 0;                  // placements that were left out
  std::size_t points_or_lines = 0;         // primitives that were left out
  std::size_t degenerate = 0;              // triangles without area, left out
  std::size_t left_over = 0;               // indices that make no whole triangle
};

// Vertices that are not finite or further than 1000 km from the origin are an Error, and so are
// indices beyond the vertices and more than kMaxTriangles triangles, counted before any is made.
Result<SceneMesh> build_mesh(const GltfScene& scene, const std::vector<PlacedNode>& placements,
                             bool with_hidden);

}  // namespace clamor
