// edge_surroundings.h: what lies about the boundary edges of a mesh.
//
// Levels are put together from pieces: a wall ends in the middle of a floor, a step touches a wall
// without sharing its corners. Such an edge has one face and yet is no opening. So every boundary
// edge is sampled, and the surfaces round each sample tell whether the edge rests on something, has
// a thin gap before it, or is free.
//
// Time: a few look-ups per edge. Input that would need more than a fixed number of looks in all is
// judged by the longest edges.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake/mesh/mesh_preparation.h"
#include "bake/mesh/triangle_tree.h"

namespace clamor {

struct EdgeSurroundings {
  enum class Kind : std::uint8_t { kFree, kRests, kGap };
  Kind kind = Kind::kFree;
  std::uint32_t triangle = 0;  // what it rests on or what lies across the gap
  double gap_m = 0;            // the widest of the samples
  Vec3 place_m{};              // of that sample
};

// A surface within `touch_m` of all samples is rested on; one within `reach_m`, seen from the edge
// away from its face and sharing no corner with the edge, makes a gap.
std::vector<EdgeSurroundings> classify_edges(const Mesh& mesh, const TriangleTree& tree,
                                             std::span<const MeshEdge> edges, double touch_m,
                                             double reach_m);

// The triangles that meet others at an edge, or nearly: both, where a sample of the edge has within
// `reach_m` a triangle of another sheet, one of its own sheet across a gap, or any within
// `touch_m`. Ascending, each once.
std::vector<std::uint32_t> contacts(const Mesh& mesh, const TriangleTree& tree,
                                    std::span<const MeshEdge> edges, double touch_m,
                                    double reach_m);

// Edges that face each other across less than the reach, put together.
struct ThinGap {
  Vec3 place_m{};      // where it is widest
  double width_m = 0;  // there
  double length_m = 0;
};
std::vector<ThinGap> thin_gaps(std::span<const MeshEdge> edges,
                               std::span<const EdgeSurroundings> surroundings);

}  // namespace clamor
