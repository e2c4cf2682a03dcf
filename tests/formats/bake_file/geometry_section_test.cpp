// geometry_section_test.cpp: geometry pages are exact to half a millimetre, decode independently
// and are safe to decode whatever they contain.
#include "formats/bake_file/geometry_section.h"

#include <map>

#include "formats/gltf/level_import.h"
#include "tests/build_paths.h"
#include "tests/formats/bake_examples.h"

namespace clamor::testing {
namespace {

// Triangles of a hall whose neighbours share vertices, some of them used long before.
Mesh hall(std::uint32_t triangles) {
  Mesh mesh;
  for (std::uint32_t i = 0; i < triangles / 2 + 3; ++i) {
    const RandomBits at = philox(17, {i, 0, 0, 0});
    mesh.vertices_m.push_back({200 * unit(at[0]) - 100, 30 * unit(at[1]), 150 * unit(at[2])});
  }
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const RandomBits bits = philox(18, {i, 0, 0, 0});
    const std::uint32_t near = i / 2, far = bits[0] % (triangles / 2 + 3);
    mesh.triangles.push_back({near, near + 1, bits[1] % 4 == 0 ? far : near + 2});
    mesh.materials.push_back(static_cast<std::uint16_t>(bits[2] % 3 == 0 ? 1 : 0));
  }
  return mesh;
}

// A regular floor of squares.
Mesh floor_of(std::uint32_t squares) {
  Mesh mesh;
  for (std::uint32_t i = 0; i <= squares; ++i)
    for (const float z : {0.0f, 0.5f})
      mesh.vertices_m.push_back({0.5f * static_cast<float>(i), 0, z});
  for (std::uint32_t i = 0; i < squares; ++i) {
    mesh.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 2});
    mesh.triangles.push_back({2 * i + 2, 2 * i + 1, 2 * i + 3});
  }
  mesh.materials.assign(mesh.triangles.size(), 0);
  return mesh;
}

Result<Mesh> read_back(const PackedGeometry& packed, std::size_t materials) {
  Mesh mesh;
  for (const PackedGeometryPage& page : packed.pages) {
    const auto read = unpack_geometry_page(page.frame, page.counts, packed.low_m, materials);
    if (!read.ok()) return read;
    append(*read, mesh);
  }
  return mesh;
}

TEST(GeometrySection, KeepsEveryTriangleWithinHalfAMillimetre) {
  const Mesh before = hall(50'000);
  const PackedGeometry packed = pack_geometry(before);
  EXPECT_EQ(packed.pages.size(), 4u);
  const auto after = read_back(packed, 2);
  ASSERT_TRUE(after.ok()) << after.error().message;
  ASSERT_EQ(after->triangles.size(), before.triangles.size());
  EXPECT_EQ(after->materials, before.materials);
  double worst_m = 0;
  std::map<std::uint32_t, Vec3f> places;  // pages agree on the position of a vertex
  for (std::size_t t = 0; t < before.triangles.size(); ++t)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t vertex = before.triangles[t][corner];
      const Vec3f now = after->vertices_m[after->triangles[t][corner]];
      const auto [place, is_new] = places.try_emplace(vertex, now);
      ASSERT_EQ(place->second, now) << t;
      for (int axis = 0; axis < 3; ++axis)
        worst_m = std::max(
            worst_m, std::abs(static_cast<double>(now[axis]) - before.vertices_m[vertex][axis]));
    }
  // Plus the float resolution at 150 m, 8e-6 m.
  EXPECT_LE(worst_m, 0.5e-3 + 1.6e-5);
  EXPECT_GT(worst_m, 0.4e-3);
}

TEST(GeometrySection, TakesAByteForATriangleOfARoom) {
  const auto imported =
      import_level(std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb", {});
  ASSERT_TRUE(imported.ok());
  const Mesh& mesh = imported->level.mesh;
  std::size_t bytes = 0;
  for (const PackedGeometryPage& page : pack_geometry(mesh).pages) bytes += page.frame.size();
  EXPECT_LT(static_cast<double>(bytes), 1.2 * static_cast<double>(mesh.triangles.size()));
}

TEST(GeometrySection, IsNeverRejectedForItsRegularity) {
  for (const std::uint32_t squares : {1u, 5u, 300u, 8192u, 60'000u}) {
    const Mesh mesh = floor_of(squares);
    const PackedGeometry packed = pack_geometry(mesh);
    for (const PackedGeometryPage& page : packed.pages)
      ASSERT_TRUE(is_geometry_page(page.counts, page.frame.size())) << squares;
    const auto read = read_back(packed, 1);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->triangles.size(), mesh.triangles.size());
  }
}

TEST(GeometrySection, OfRandomBytesIsRejectedOrValid) {
  const PackedGeometry packed = pack_geometry(hall(400));
  const PackedGeometryPage& page = packed.pages[0];
  const auto bytes = unpacked(page.frame, 12 * page.counts.vertices + 8 * page.counts.triangles);
  ASSERT_TRUE(bytes.ok());
  int refused = 0;
  for (std::uint32_t round = 0; round < 5000; ++round) {
    auto changed = *bytes;
    const RandomBits bits = philox(19, {round, 0, 0, 0});
    for (std::uint32_t k = 0; k <= bits[0] % 3; ++k) {
      const RandomBits where = philox(19, {round, 1, k, 0});
      changed[where[0] % changed.size()] = static_cast<std::byte>(where[1]);
    }
    const auto mesh =
        unpack_geometry_page(zstd_compress_fast(changed), page.counts, packed.low_m, 2);
    refused += !mesh.ok();
    if (!mesh.ok()) continue;
    ASSERT_EQ(mesh->triangles.size(), page.counts.triangles);
    for (const auto& triangle : mesh->triangles)
      for (const std::uint32_t corner : triangle) ASSERT_LT(corner, mesh->vertices_m.size());
    for (const std::uint16_t material : mesh->materials) ASSERT_LT(material, 2);
    for (const Vec3f& vertex : mesh->vertices_m)
      ASSERT_TRUE(std::isfinite(vertex.x + vertex.y + vertex.z));
  }
  EXPECT_GT(refused, 500);   // corners and materials
  EXPECT_LT(refused, 4500);  // positions may be anything
}

TEST(GeometrySection, TruncatedAtAnyByteIsRejected) {
  const PackedGeometry packed = pack_geometry(hall(100));
  const PackedGeometryPage& page = packed.pages[0];
  for (std::size_t size = 0; size < page.frame.size(); ++size)
    EXPECT_FALSE(
        unpack_geometry_page(std::span(page.frame).first(size), page.counts, packed.low_m, 2).ok())
        << size;
}

BakeContents with_hall() {
  BakeContents bake = contents();
  bake.mesh = hall(50'000);
  return bake;
}

TEST(GeometrySection, IsTheSameBytesOn1And2And7Threads) {
  const Bytes one = written(with_hall(), 1);
  EXPECT_TRUE(one == written(with_hall(), 2));
  EXPECT_TRUE(one == written(with_hall(), 7));
}

TEST(GeometrySection, WithADamagedPageNamesItAndKeepsTheOthersReadable) {
  const std::string path = path_of("geometry.clamor");
  ASSERT_TRUE(write_bake(path, with_hall(), 2).ok());
  const auto whole = BakeFile::open(path);
  ASSERT_TRUE(whole.ok());
  ASSERT_EQ(whole->geometry_page_count(), 4u);
  const GeometryPageInfo third = whole->geometry_page(2);
  EXPECT_EQ(third.triangles, kPageTriangles);
  Bytes bytes = read(path);
  bytes[third.offset + third.packed_bytes / 2] ^= 1;
  std::ofstream(path, std::ios::binary) << bytes;

  const auto file = BakeFile::open(path);
  ASSERT_TRUE(file.ok());
  const auto mesh = file->read_mesh();
  ASSERT_FALSE(mesh.ok());
  EXPECT_NE(mesh.error().message.find("page 3 of 4 of the geometry"), std::string::npos)
      << mesh.error().message;
  EXPECT_NE(mesh.error().message.find("fails its checksum"), std::string::npos);
  for (const std::size_t page : {0u, 1u, 3u}) EXPECT_TRUE(file->read_geometry_page(page).ok());
  std::filesystem::remove(path);
}

TEST(GeometrySection, OfFormatThreePointZeroIsReadAsOnePage) {
  const auto file =
      BakeFile::open(std::string(testing::kSourceDir) + "/tests/formats/golden/3.0.clamor");
  ASSERT_TRUE(file.ok()) << file.error().message;
  EXPECT_EQ(file->minor(), 0);
  ASSERT_EQ(file->geometry_page_count(), 1u);
  EXPECT_EQ(file->geometry_page(0).triangles, 2u);
  const auto mesh = file->read_geometry_page(0);
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->vertices_m.size(), 4u);
}

}  // namespace
}  // namespace clamor::testing
