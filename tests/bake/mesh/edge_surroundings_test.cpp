#include "bake/mesh/edge_surroundings.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/bake/mesh/mesh_shapes.h"

namespace clamor {
namespace {

// 25 000 such slivers kept the search busy for minutes.
TEST(EdgeSurroundings, AreUnknownOnceTheVisitsAreSpent) {
  const PreparedMesh prepared = prepare_mesh(testing::crossing_slivers(300));
  const TriangleTree tree(prepared.mesh);
  const std::vector<MeshEdge>& edges = prepared.boundary_edges;
  ASSERT_GT(edges.size(), 800u);
  const auto unknown = [&](std::size_t max_visits) {
    const auto found = classify_edges(prepared.mesh, tree, edges, 1e-5, 0.02, nullptr, max_visits);
    return static_cast<std::size_t>(
        std::ranges::count(found, EdgeSurroundings::Kind::kUnknown, &EdgeSurroundings::kind));
  };
  EXPECT_EQ(unknown(kMaxEdgeVisits), 0u);
  // An edge visits at most 2 x 8 x 4000 nodes and triangles.
  EXPECT_GT(unknown(1'000'000), edges.size() / 2);
  EXPECT_LT(unknown(1'000'000), edges.size() - 10);
}

TEST(EdgeSurroundings, ThatWereNotSearchedAreReportedAsContacts) {
  const PreparedMesh prepared = prepare_mesh(testing::crossing_slivers(100));
  const TriangleTree tree(prepared.mesh);
  const auto touching = contacts(prepared.mesh, tree, prepared.boundary_edges, 1e-9, 1e-9, 0);
  EXPECT_EQ(touching.size(), prepared.mesh.triangles.size());
}

}  // namespace
}  // namespace clamor
