// level_openings.h: locates the openings through which sound leaves a level.
//
// Random walks start at the emitters and are reflected diffusely, losing power to absorption. Each
// walk that leaves the level gives a line through some opening. The point nearest to all lines of a
// bundle is the centre of the opening, and their mean distance from it gives its size; in a diffuse
// field both are exact for a flat opening. A bundle that two points fit far better than one is
// split into two openings.
//
// The random numbers are fixed, so the result depends on the input alone. Takes about 0.1 s.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "bake/mesh/mesh_preparation.h"
#include "bake/trace/scene.h"

namespace clamor {

struct Level;

struct LevelOpening {
  double share = 0;          // share of the emitted power that leaves here
  Vec3 place_m{};            // centre, clamped to the level's bounds
  Vec3 direction{};          // mean direction of the escaping sound; shorter than 1 if it spreads
  Vec3 squared_direction{};  // means of the squares of its components
  double width_m = 0;        // diameter of an equivalent disc; 0: unknown, as is the centre
  double edge_length_m = 0;  // length of the open edge along the opening, 0 if there is none
};

struct LevelOpenings {
  std::size_t rays = 0, escaped = 0;
  double escaped_share = 0;            // share of the emitted power
  double mean_free_path_m = 0;         // mean distance between surface hits
  std::vector<LevelOpening> openings;  // largest share first
};

// Starts walks in all directions at `starts_m`, the positions of emitters. `free_edges` are the
// boundary edges that touch no surface. Without starts or triangles nothing is traced.
LevelOpenings find_openings(const Scene& scene, const Level& level, std::span<const Vec3> starts_m,
                            std::span<const MeshEdge> free_edges);

// Volume of the largest closed sheet minus those inside it; 0 if any sheet is open.
double enclosed_volume_m3(const PreparedMesh& prepared);

}  // namespace clamor
