// level_openings.h: where sound leaves a level.
//
// Rays walk through the level as sound does, from the emitters from surface to surface (diffusely,
// losing what the materials absorb). Those that leave are lines that went through some opening; the
// point nearest to all lines of a bundle is the middle of it, and their mean distance from there
// its size: in a diffuse field both are exact for a flat opening. A bundle that two points explain
// far better than one comes from two openings.
//
// A function of its input alone: the random numbers are always the same. Takes some 0.1 s.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "bake/mesh/mesh_preparation.h"
#include "bake/trace/scene.h"
#include "formats/level/level.h"

namespace clamor {

struct LevelOpening {
  double share = 0;          // of all sound, that leaves here
  Vec3 place_m{};            // its middle, within the level's bounds
  Vec3 direction{};          // mean of those that leave; shorter than 1 the more they spread
  double width_m = 0;        // as if it were round; 0: unknown, and then so is its middle
  double edge_length_m = 0;  // of the open edge that runs along most of it, 0 if there is none
};

struct LevelOpenings {
  std::size_t rays = 0, escaped = 0;
  double escaped_share = 0;            // of the sound's power
  double mean_free_path_m = 0;         // between surfaces
  std::vector<LevelOpening> openings;  // the largest share first
};

// Rays start at these places of emitters, in all directions; without any, nothing is traced.
// `free_edges` are those boundary edges that rest on nothing.
LevelOpenings find_openings(const Scene& scene, const Level& level, std::span<const Vec3> starts_m,
                            std::span<const MeshEdge> free_edges);

// The volume that closed sheets enclose: the largest less those within it. 0 if any sheet is open.
double enclosed_volume_m3(const PreparedMesh& prepared);

}  // namespace clamor
