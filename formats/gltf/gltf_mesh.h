// gltf_mesh.h: collects the triangles of a glTF scene in the level's coordinates, and those of
// movable parts in their own.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/result.h"
#include "formats/gltf/gltf_movable.h"
#include "formats/gltf/gltf_placement.h"
#include "formats/gltf/gltf_scene.h"
#include "formats/gltf/gltf_surfaces.h"
#include "formats/level/mesh.h"

namespace clamor {

inline constexpr std::uint64_t kMaxTriangles = 200'000'000;

// The triangles and vertices of one placement of a node's mesh.
struct PlacedTriangles {
  int node = 0;
  std::size_t first_vertex = 0, end_vertex = 0, first_triangle = 0, end_triangle = 0;
};

struct SceneMesh {
  // Mesh::materials contains indices of glTF materials; a primitive without material has the index
  // after the last.
  Mesh mesh;
  // How far apart two vertices may be that were one before their file rounded positions to integers
  // (KHR_mesh_quantization); 0: it did not.
  double rounding_m = 0;
  std::vector<PlacedTriangles> placed;     // of `mesh`, in its order; without movable parts
  std::vector<Mesh> parts;                 // of MovableNodes::parts, relative to their pivots
  std::size_t meshes = 0, placements = 0;  // that contributed triangles
  std::vector<int> skinned, keyed;         // nodes whose meshes skins or shape keys move
  std::vector<std::string> unposed;        // skipped meshes, and what is wrong with their pose
  std::size_t points_or_lines = 0;         // skipped primitives
  std::size_t degenerate = 0;              // skipped triangles without area
  std::size_t left_over = 0;               // trailing indices without a complete triangle
};

// Errors: vertices that are not finite or more than 1000 km from the level's origin, indices beyond
// the vertices, and more than kMaxTriangles triangles, which are counted before any is created;
// more than kMaxMovableTriangles in movable parts.
Result<SceneMesh> build_mesh(const GltfScene& scene, const std::vector<PlacedNode>& placements,
                             const MovableNodes& movable, const SceneSurfaces& surfaces);

// Removes the placements for which `goes` is true of their index, and renumbers the rest.
void remove_placed(SceneMesh& mesh, const std::function<bool(std::size_t)>& goes);

// The triangles of one node, surfaces or not. It must have a mesh.
Result<Mesh> placed_mesh(const GltfScene& scene, const PlacedNode& placement);

}  // namespace clamor
