#include "bake/mesh/edge_surroundings.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "common/disjoint_sets.h"

namespace clamor {

namespace {

constexpr double kSampleEvery_m = 0.25;
constexpr double kMaxSamples = 8;
constexpr std::size_t kMaxVisitsOfSearch = 4000;
// Cos 45 degrees: a gap lies within this angle of the direction away from the face.
constexpr double kAhead = 0.7071067811865476;
constexpr double kSlender = 5;  // minimum ratio of length to width of a gap

Vec3 corner(const Mesh& mesh, std::uint32_t vertex) { return Vec3(mesh.vertices_m[vertex]); }

// Compares positions, because vertices are duplicated where sheets meet.
bool shares_a_corner(const Mesh& mesh, std::uint32_t triangle, const MeshEdge& edge) {
  for (const std::uint32_t a : mesh.triangles[triangle])
    for (const std::uint32_t b : edge.vertices)
      if (mesh.vertices_m[a] == mesh.vertices_m[b]) return true;
  return false;
}

// Unit direction in the plane of the edge's face, away from the face.
Vec3 ahead_of(const Mesh& mesh, const MeshEdge& edge) {
  const Vec3 a = corner(mesh, edge.vertices[0]), b = corner(mesh, edge.vertices[1]);
  const Vec3 along = (b - a) / length(b - a);
  Vec3 third = a;
  for (const std::uint32_t vertex : mesh.triangles[edge.triangle])
    if (vertex != edge.vertices[0] && vertex != edge.vertices[1]) third = corner(mesh, vertex);
  const Vec3 back = (third - a) - along * dot(third - a, along);
  const double height_m = length(back);
  return height_m > 0 ? -back / height_m : Vec3(0);
}

int samples_on(const MeshEdge& edge) {
  return static_cast<int>(std::clamp(std::ceil(edge.length_m / kSampleEvery_m), 2.0, kMaxSamples));
}

// Indices of the edges in order of importance.
std::vector<std::size_t> longest_first(std::span<const MeshEdge> edges) {
  std::vector<std::size_t> order(edges.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
    return edges[i].length_m > edges[j].length_m;
  });
  return order;
}

EdgeSurroundings classify_edge(const Mesh& mesh, const TriangleTree& tree, const MeshEdge& edge,
                               double touch_m, double reach_m, std::size_t& visits) {
  EdgeSurroundings found;
  if (!(edge.length_m > 0)) return found;
  const Vec3 a = corner(mesh, edge.vertices[0]), b = corner(mesh, edge.vertices[1]);
  const Vec3 ahead = ahead_of(mesh, edge);
  const int samples = samples_on(edge);
  int resting = 0, before_gap = 0;
  for (int i = 0; i < samples; ++i) {
    const Vec3 at = a + (b - a) * ((i + 0.5) / samples);
    const auto other = [&](std::uint32_t triangle, const Vec3&) {
      return triangle != edge.triangle;
    };
    if (const auto touched = tree.nearest(at, touch_m, other, kMaxVisitsOfSearch, &visits)) {
      ++resting;
      found.seam_m = std::max(found.seam_m, touched->distance_m);
      if (before_gap == 0) found.triangle = touched->triangle;
      continue;
    }
    const auto across = [&](std::uint32_t triangle, const Vec3& point_m) {
      const Vec3 offset_m = point_m - at;
      return triangle != edge.triangle && dot(offset_m, ahead) >= kAhead * length(offset_m) &&
             !shares_a_corner(mesh, triangle, edge);
    };
    if (const auto hit = tree.nearest(at, reach_m, across, kMaxVisitsOfSearch, &visits)) {
      ++before_gap;
      if (hit->distance_m <= found.gap_m) continue;
      found.gap_m = hit->distance_m;
      found.triangle = hit->triangle;
      found.place_m = at;
    }
  }
  // A gap may close at one end. An edge that is free along most of its length borders no gap.
  if (resting == samples)
    found.kind = EdgeSurroundings::Kind::kRests;
  else if (before_gap > 0 && 2 * (resting + before_gap) > samples)
    found.kind = EdgeSurroundings::Kind::kGap;
  return found;
}

}  // namespace

std::vector<EdgeSurroundings> classify_edges(const Mesh& mesh, const TriangleTree& tree,
                                             std::span<const MeshEdge> edges, double touch_m,
                                             double reach_m, const std::atomic<bool>* stop,
                                             std::size_t max_visits) {
  std::vector<EdgeSurroundings> all(edges.size());
  std::size_t visits = 0;
  for (const std::size_t i : longest_first(edges)) {
    if (stop != nullptr && *stop) break;
    if (visits > max_visits)
      all[i].kind = EdgeSurroundings::Kind::kUnknown;
    else
      all[i] = classify_edge(mesh, tree, edges[i], touch_m, reach_m, visits);
  }
  return all;
}

std::vector<std::uint32_t> contacts(const Mesh& mesh, const TriangleTree& tree,
                                    std::span<const MeshEdge> edges, double touch_m, double reach_m,
                                    std::size_t max_visits) {
  const auto sheet = sheets_of(mesh);
  std::vector<std::uint32_t> touching;
  std::size_t visits = 0;
  for (const std::size_t i : longest_first(edges)) {
    const MeshEdge& edge = edges[i];
    if (!(edge.length_m > 0)) continue;
    if (visits > max_visits) {  // budget exhausted: fix the rest rather than risk a crack
      touching.push_back(edge.triangle);
      continue;
    }
    const Vec3 a = corner(mesh, edge.vertices[0]), b = corner(mesh, edge.vertices[1]);
    const Vec3 ahead = ahead_of(mesh, edge);
    const std::uint32_t own_sheet = sheet[edge.vertices[0]];
    const int samples = samples_on(edge);
    for (int s = 0; s < samples; ++s) {
      const Vec3 at = a + (b - a) * ((s + 0.5) / samples);
      const auto another = [&](std::uint32_t triangle, const Vec3& point_m) {
        if (triangle == edge.triangle) return false;
        if (sheet[mesh.triangles[triangle][0]] != own_sheet) return true;
        const Vec3 offset_m = point_m - at;
        const double away_m = length(offset_m);
        return away_m <= touch_m ||
               (dot(offset_m, ahead) >= kAhead * away_m && !shares_a_corner(mesh, triangle, edge));
      };
      if (const auto hit = tree.nearest(at, reach_m, another, kMaxVisitsOfSearch, &visits))
        touching.insert(touching.end(), {edge.triangle, hit->triangle});
    }
  }
  std::sort(touching.begin(), touching.end());
  touching.erase(std::unique(touching.begin(), touching.end()), touching.end());
  return touching;
}

std::vector<ThinGap> thin_gaps(std::span<const MeshEdge> edges,
                               std::span<const EdgeSurroundings> surroundings) {
  assert(edges.size() == surroundings.size());
  DisjointSets<std::size_t> gap_of(edges.size());

  // Gaps grow along chains of edges by shared vertices, and across the gap by the facing triangle.
  std::unordered_map<std::uint32_t, std::size_t> at_vertex, of_triangle;
  const auto is_gap = [&](std::size_t i) {
    return surroundings[i].kind == EdgeSurroundings::Kind::kGap;
  };
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!is_gap(i)) continue;
    for (const std::uint32_t vertex : edges[i].vertices)
      gap_of.join(i, at_vertex.try_emplace(vertex, i).first->second);
    gap_of.join(i, of_triangle.try_emplace(edges[i].triangle, i).first->second);
  }
  std::vector<double> share(edges.size(), 1);  // one half where both sides of the gap are edges
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!is_gap(i)) continue;
    const auto facing = of_triangle.find(surroundings[i].triangle);
    if (facing == of_triangle.end()) continue;
    gap_of.join(i, facing->second);
    share[i] = 0.5;
  }

  std::vector<ThinGap> by_root(edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!is_gap(i)) continue;
    ThinGap& gap = by_root[gap_of.root_of(i)];
    gap.length_m += share[i] * edges[i].length_m;
    if (surroundings[i].gap_m <= gap.width_m) continue;
    gap.width_m = surroundings[i].gap_m;
    gap.place_m = surroundings[i].place_m;
  }
  std::vector<ThinGap> gaps;
  std::copy_if(by_root.begin(), by_root.end(), std::back_inserter(gaps), [](const ThinGap& gap) {
    return gap.width_m > 0 && gap.length_m >= kSlender * gap.width_m;
  });
  // Ordered by area, which decides how much sound leaks through.
  std::stable_sort(gaps.begin(), gaps.end(), [](const ThinGap& a, const ThinGap& b) {
    return a.width_m * a.length_m > b.width_m * b.length_m;
  });
  return gaps;
}

}  // namespace clamor
