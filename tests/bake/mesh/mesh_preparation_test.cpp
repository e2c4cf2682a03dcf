#include "bake/mesh/mesh_preparation.h"

#include <map>
#include <set>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <gtest/gtest.h>

#include "bake/mesh/vertex_welding.h"
#include "tests/bake/mesh/mesh_shapes.h"

namespace clamor {
namespace {

using testing::add;
using testing::box;
using testing::fine_box;
using testing::patch;
using testing::random_soup;
using testing::real_level;
using testing::whole_area_m2;

// Gives every triangle vertices of its own, each displaced by less than `by_m`.
Mesh torn(const Mesh& mesh, double by_m) {
  Mesh apart;
  std::uint32_t draw = 0;
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(apart.vertices_m.size());
    for (const auto corner : triangle) {
      const RandomBits bits = philox(4, {draw++, 0, 0, 0});
      const Vec3 shift(unit(bits[0]) - 0.5, unit(bits[1]) - 0.5, unit(bits[2]) - 0.5);
      apart.vertices_m.emplace_back(Vec3(mesh.vertices_m[corner]) + shift * by_m);
    }
    apart.triangles.push_back({first, first + 1, first + 2});
  }
  apart.materials = mesh.materials;
  return apart;
}

// The multiset of triangles by position, independent of vertex order.
using Faces = std::multiset<std::pair<std::vector<std::array<float, 3>>, std::uint16_t>>;
std::vector<std::array<float, 3>> places_of(const Mesh& mesh, std::size_t triangle) {
  std::vector<std::array<float, 3>> places;
  for (const auto corner : mesh.triangles[triangle]) {
    const Vec3f& p = mesh.vertices_m[corner];
    places.push_back({p.x, p.y, p.z});
  }
  return places;
}

// Number of faces that OpenMesh rejects after all sheets are oriented.
std::size_t refused_by_openmesh(const PreparedMesh& prepared) {
  OpenMesh::TriMesh_ArrayKernelT<> surface;
  for (const Vec3f& p : prepared.mesh.vertices_m) surface.add_vertex({p.x, p.y, p.z});
  std::size_t refused = 0;
  for (std::size_t t = 0; t < prepared.mesh.triangles.size(); ++t) {
    auto corners = prepared.mesh.triangles[t];
    if (prepared.turned[t] != 0) std::swap(corners[1], corners[2]);
    const auto vertex = [&](std::size_t c) {
      return OpenMesh::VertexHandle(static_cast<int>(corners[c]));
    };
    refused += !surface.add_face(vertex(0), vertex(1), vertex(2)).is_valid();
  }
  return refused;
}

TEST(MeshPreparation, ClosesABoxWhoseFacesWereTornApart) {
  const Mesh mesh = torn(box({5, 4, 3}, {0, 1, 2, 3, 4, 5}), 3e-5);
  const PreparedMesh prepared = prepare_mesh(mesh);
  EXPECT_EQ(prepared.mesh.vertices_m.size(), 8u);
  EXPECT_EQ(prepared.welded_vertices, 28u);
  EXPECT_EQ(prepared.mesh.materials, mesh.materials);
  EXPECT_TRUE(prepared.boundary_edges.empty());
  EXPECT_EQ(prepared.feature_edges.size(), 12u);
}

TEST(MeshPreparation, LeavesAGapOfAMillimetreOpen) {
  EXPECT_FALSE(prepare_mesh(torn(box({5, 4, 3}), 2e-3)).boundary_edges.empty());
}

TEST(MeshPreparation, KeepsEachDistinctTriangleOfRandomSoupOnceWithAllArea) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Mesh soup = random_soup(seed, 50 + 40 * static_cast<std::uint32_t>(seed), 3);
    // Brute force: the first triangle of each set of vertices that has an area.
    std::map<std::vector<std::array<float, 3>>, std::size_t> first;
    Faces expected;
    std::size_t degenerate = 0;
    double expected_m2 = 0;
    for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
      auto places = places_of(soup, t);
      std::sort(places.begin(), places.end());
      if (area_m2(soup, t) == 0) {
        ++degenerate;
      } else if (first.emplace(places, t).second) {
        expected.insert({places, soup.materials[t]});
        expected_m2 += area_m2(soup, t);
      }
    }

    const PreparedMesh prepared = prepare_mesh(soup);
    Faces found;
    for (std::size_t t = 0; t < prepared.mesh.triangles.size(); ++t) {
      auto places = places_of(prepared.mesh, t);
      std::sort(places.begin(), places.end());
      found.insert({places, prepared.mesh.materials[t]});
    }
    EXPECT_EQ(found, expected);
    EXPECT_EQ(prepared.degenerate, degenerate);
    EXPECT_EQ(prepared.duplicated, soup.triangles.size() - degenerate - expected.size());
    EXPECT_NEAR(whole_area_m2(prepared.mesh), expected_m2, 1e-9 * expected_m2);
    EXPECT_NEAR(whole_area_m2(soup), expected_m2 + prepared.duplicated_m2, 1e-9 * expected_m2);
  }
}

TEST(MeshPreparation, MakesManifoldSheetsOfRandomSoup) {
  for (std::uint64_t seed = 100; seed < 140; ++seed) {
    const PreparedMesh prepared = prepare_mesh(random_soup(seed, 1500, 3 + seed % 4));
    EXPECT_GT(prepared.split_edges, 0u);
    EXPECT_EQ(refused_by_openmesh(prepared), 0u) << "seed " << seed;
  }
}

TEST(MeshPreparation, KeepsWindingsAndFindsTheSameEdgesForAnyWinding) {
  const Mesh mesh = fine_box({5, 4, 3}, 4);
  Mesh mixed = mesh;
  for (std::uint32_t t = 0; t < mixed.triangles.size(); ++t)
    if (philox(9, {t, 0, 0, 0})[0] % 2 == 0)
      std::swap(mixed.triangles[t][1], mixed.triangles[t][2]);
  const PreparedMesh a = prepare_mesh(mesh), b = prepare_mesh(mixed);
  for (std::size_t t = 0; t < mixed.triangles.size(); ++t)
    EXPECT_EQ(places_of(mixed, t), places_of(b.mesh, t));
  EXPECT_EQ(b.split_edges, 0u);
  EXPECT_TRUE(b.boundary_edges.empty());
  EXPECT_EQ(a.feature_edges.size(), b.feature_edges.size());
  EXPECT_EQ(b.feature_edges.size(), 12u * 4);
  EXPECT_EQ(refused_by_openmesh(b), 0u);
}

TEST(MeshPreparation, KeepsTheFirstOfCoincidentFacesAndNamesBothMaterials) {
  Mesh mesh = box({5, 4, 3}, {0, 0, 0, 0, 0, 0});
  Mesh wall = box({5, 4, 3}, {7, 7, 7, 7, 7, 7});
  wall.triangles.resize(2);  // x = 0, 4 m x 3 m
  wall.materials.resize(2);
  std::swap(wall.triangles[0][0], wall.triangles[0][1]);  // flipped
  add(mesh, wall);
  const PreparedMesh prepared = prepare_mesh(mesh);
  EXPECT_EQ(prepared.mesh.triangles.size(), 12u);
  EXPECT_EQ(prepared.mesh.materials, std::vector<std::uint16_t>(12, 0));
  ASSERT_EQ(prepared.clashes.size(), 1u);
  EXPECT_EQ(prepared.clashes[0].kept, 0);
  EXPECT_EQ(prepared.clashes[0].dropped, 7);
  EXPECT_EQ(prepared.clashes[0].faces, 2u);
  EXPECT_NEAR(prepared.clashes[0].area_m2, 12, 1e-12);
}

TEST(MeshPreparation, FindsTheRimOfABoxWithoutALid) {
  Mesh mesh = box({5, 4, 3});
  mesh.triangles.erase(mesh.triangles.begin() + 6, mesh.triangles.begin() + 8);  // y = 4
  mesh.materials.resize(10);
  const PreparedMesh prepared = prepare_mesh(mesh);
  double rim_m = 0;
  for (const MeshEdge& edge : prepared.boundary_edges) {
    rim_m += edge.length_m;
    for (const auto vertex : edge.vertices) EXPECT_EQ(prepared.mesh.vertices_m[vertex].y, 4);
  }
  EXPECT_EQ(prepared.boundary_edges.size(), 4u);
  EXPECT_NEAR(rim_m, 2 * (5 + 3), 1e-12);
  EXPECT_EQ(prepared.feature_edges.size(), 8u);
}

TEST(MeshPreparation, FindsFeatureEdgesOnEightSidedColumnsButNotOnTwelveSidedOnes) {
  const auto column = [](std::uint32_t sides) {
    const Mesh mesh = patch(sides, 1, [](double u, double v) {
      const double angle = 2 * std::numbers::pi * u;
      return Vec3(0.3 * std::cos(angle), 3 * v, 0.3 * std::sin(angle));
    });
    return prepare_mesh(mesh);
  };
  EXPECT_EQ(column(8).feature_edges.size(), 8u);
  EXPECT_TRUE(column(12).feature_edges.empty());
  EXPECT_EQ(column(12).boundary_edges.size(), 24u);
}

TEST(MeshPreparation, SeparatesAFinFromABoxThatStaysClosed) {
  Mesh mesh = box({2, 2, 2});
  Mesh fin;  // a fin on the edge from (2, 2, 0) to (2, 2, 2)
  fin.vertices_m = {{2, 2, 0}, {2, 2, 2}, {3, 3, 1}};
  fin.triangles = {{0, 1, 2}};
  fin.materials = {1};
  add(mesh, fin);
  const PreparedMesh prepared = prepare_mesh(mesh);
  EXPECT_EQ(prepared.split_edges, 1u);
  EXPECT_EQ(prepared.split_vertices, 2u);
  EXPECT_EQ(prepared.mesh.vertices_m.size(), 11u);
  EXPECT_EQ(prepared.boundary_edges.size(), 2u);  // free sides of the fin
  EXPECT_EQ(refused_by_openmesh(prepared), 0u);
}

TEST(MeshPreparation, CutsAMoebiusStrip) {
  const Mesh strip = patch(40, 2, [](double u, double v) {
    const double turn = 2 * std::numbers::pi * u, w = v - 0.5;
    const double r = 2 + w * std::cos(turn / 2);
    return Vec3(r * std::cos(turn), w * std::sin(turn / 2), r * std::sin(turn));
  });
  const PreparedMesh prepared = prepare_mesh(strip);
  EXPECT_EQ(prepared.mesh.triangles.size(), strip.triangles.size());
  EXPECT_GT(prepared.split_edges, 0u);
  EXPECT_EQ(prepared.boundary_edges.size(), 80u);  // the cut does not count as boundary
  EXPECT_EQ(refused_by_openmesh(prepared), 0u);
}

TEST(MeshPreparation, IsIdempotent) {
  const PreparedMesh once = prepare_mesh(random_soup(1, 3000, 5));
  PreparationOptions same;
  same.weld_m = once.weld_m;
  const PreparedMesh twice = prepare_mesh(once.mesh, same);
  EXPECT_EQ(once.mesh, twice.mesh);
  EXPECT_EQ(twice.duplicated + twice.degenerate, 0u);
}

TEST(MeshPreparation, AcceptsAnEmptyMesh) {
  const PreparedMesh prepared = prepare_mesh({});
  EXPECT_TRUE(prepared.mesh.triangles.empty());
  EXPECT_TRUE(prepared.boundary_edges.empty());
}

TEST(MeshPreparation, IsFastForAdversarialMeshes) {
  constexpr std::uint32_t kMany = 100'000;  // a quadratic algorithm would take minutes
  Mesh fan, same, point;
  fan.vertices_m = {{0, 0, 0}};
  same.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  for (std::uint32_t i = 0; i < kMany; ++i) {
    const double angle = 2 * std::numbers::pi * i / kMany;
    fan.vertices_m.emplace_back(1000 * std::cos(angle), i % 2, 1000 * std::sin(angle));
    fan.triangles.push_back({0, i + 1, (i + 1) % kMany + 1});
    same.triangles.push_back({i % 3, (i + 1) % 3, (i + 2) % 3});
    // All vertices lie within one welding distance of each other.
    point.vertices_m.emplace_back(1 + 1e-7 * (i % 10), 1 + 1e-7 * (i % 11), 1 + 1e-7 * (i % 13));
    point.triangles.push_back({i, (i + 1) % kMany, (i + 2) % kMany});
  }
  for (Mesh* mesh : {&fan, &same, &point}) mesh->materials.assign(kMany, 0);
  EXPECT_EQ(prepare_mesh(fan).mesh.triangles.size(), kMany);
  EXPECT_EQ(prepare_mesh(same).mesh.triangles.size(), 1u);
  EXPECT_EQ(prepare_mesh(same).duplicated, kMany - 1);
  PreparationOptions wide;
  wide.weld_m = 1e-4;
  EXPECT_EQ(prepare_mesh(point, wide).degenerate, kMany);
}

TEST(VertexWelding, JoinsTheNearestWithinTheDistanceAndLeavesNoPairCloser) {
  constexpr double kDistance = 0.1;
  Mesh mesh;
  for (std::uint32_t i = 0; i < 3000; ++i) {
    const RandomBits bits = philox(8, {i, 0, 0, 0});
    mesh.vertices_m.emplace_back(unit(bits[0]) - 0.5, unit(bits[1]) - 0.5, unit(bits[2]) - 0.5);
    mesh.triangles.push_back({i, i, i});
  }
  const Welding welding = weld_vertices(mesh, kDistance);
  std::vector<std::uint32_t> standing;  // brute force
  std::size_t welded = 0;
  for (std::uint32_t i = 0; i < mesh.vertices_m.size(); ++i) {
    std::uint32_t nearest = i;
    double nearest_m = kDistance;
    for (const std::uint32_t other : standing) {
      const double apart_m = length(Vec3(mesh.vertices_m[other]) - Vec3(mesh.vertices_m[i]));
      if (apart_m >= nearest_m) continue;
      nearest_m = apart_m;
      nearest = other;
    }
    if (nearest == i)
      standing.push_back(i);
    else
      ++welded;
    ASSERT_EQ(welding.representative[i], nearest);
  }
  EXPECT_EQ(welding.welded, welded);
  EXPECT_GT(welded, 500u);
}

class RealMeshes : public ::testing::TestWithParam<const char*> {};

TEST_P(RealMeshes, LoseOnlyDuplicateAreaAndBecomeManifold) {
  const auto level = real_level(GetParam());
  if (!level) GTEST_SKIP() << "not on this machine: " << GetParam();
  const PreparedMesh prepared = prepare_mesh(level->mesh);
  EXPECT_EQ(prepared.mesh.triangles.size() + prepared.degenerate + prepared.duplicated,
            level->mesh.triangles.size());
  // Vertices move by at most the welding distance, which moves area along the sides.
  double sides_m = 0;
  for (const auto& corners : level->mesh.triangles)
    for (std::size_t c = 0; c < 3; ++c)
      sides_m += length(Vec3(level->mesh.vertices_m[corners[c]]) -
                        Vec3(level->mesh.vertices_m[corners[(c + 1) % 3]]));
  const double before_m2 = whole_area_m2(level->mesh);
  EXPECT_NEAR(whole_area_m2(prepared.mesh) + prepared.degenerate_m2 + prepared.duplicated_m2,
              before_m2, std::min(1e-5 * before_m2, prepared.weld_m * sides_m));
  EXPECT_EQ(refused_by_openmesh(prepared), 0u);
  PreparationOptions same;
  same.weld_m = prepared.weld_m;
  EXPECT_EQ(prepare_mesh(prepared.mesh, same).mesh, prepared.mesh);
}

INSTANTIATE_TEST_SUITE_P(All, RealMeshes,
                         ::testing::Values("sibenik.glb", "sponza.glb", "stadium.glb",
                                           "bathroom.glb", "sampleroom.gltf",
                                           "boom_box/boom_box.gltf"),
                         [](const auto& level) {
                           std::string name = level.param;
                           std::replace_if(
                               name.begin(), name.end(), [](char c) { return !std::isalnum(c); },
                               '_');
                           return name;
                         });

}  // namespace
}  // namespace clamor
