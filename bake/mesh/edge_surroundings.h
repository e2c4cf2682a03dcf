// edge_surroundings.h: classifies boundary edges by the surfaces next to them.
//
// Levels are assembled from pieces: a wall ends in the middle of a floor, a step touches a wall
// without sharing its vertices. Such an edge has one face and yet is no opening. Every boundary
// edge is therefore sampled, and the surfaces near its samples tell whether the edge touches a
// surface, faces a thin gap or is free.
//
// Time: a few nearest-triangle queries per edge, and a fixed maximum in total, spent on the longest
// edges: where thousands of long triangles cross, each query visits them all.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/mesh/mesh_preparation.h"
#include "bake/mesh/triangle_tree.h"

namespace clamor {

// Nodes and triangles of a tree that all queries for a level may visit: about two seconds.
inline constexpr std::size_t kMaxEdgeVisits = 30'000'000;

struct EdgeSurroundings {
  enum class Kind : std::uint8_t { kFree, kRests, kGap, kUnknown };
  Kind kind = Kind::kFree;
  std::uint32_t triangle = 0;  // the surface it rests on, or the one across the gap
  double gap_m = 0;            // maximum over the samples
  Vec3 place_m{};              // the sample with the widest gap
  double seam_m = 0;           // maximum distance of the surface that the edge rests on
};

// An edge rests on surfaces if all its samples have one within `touch_m`. It borders a gap if
// samples see a surface within `reach_m`, on the far side from the edge's face, that shares no
// vertex with the edge. After `max_visits` the remaining, shortest edges are unknown.
std::vector<EdgeSurroundings> classify_edges(const Mesh& mesh, const TriangleTree& tree,
                                             std::span<const MeshEdge> edges, double touch_m,
                                             double reach_m,
                                             const std::atomic<bool>* stop = nullptr,
                                             std::size_t max_visits = kMaxEdgeVisits);

// Triangles that touch or nearly touch others at a boundary edge, ascending and unique. A sample of
// the edge has within `reach_m` a triangle of another sheet or one of its own sheet across a gap,
// or any triangle within `touch_m`; both triangles are returned. After `max_visits` the triangles
// of the remaining edges are returned as well.
std::vector<std::uint32_t> contacts(const Mesh& mesh, const TriangleTree& tree,
                                    std::span<const MeshEdge> edges, double touch_m, double reach_m,
                                    std::size_t max_visits = kMaxEdgeVisits);

// A chain of edges that face each other across less than the reach.
struct ThinGap {
  Vec3 place_m{};      // where the gap is widest
  double width_m = 0;  // maximum
  double length_m = 0;
};
std::vector<ThinGap> thin_gaps(std::span<const MeshEdge> edges,
                               std::span<const EdgeSurroundings> surroundings);

}  // namespace clamor
