#include "formats/bake_file/geometry_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "common/bounds.h"
#include "common/memory_size.h"
#include "common/thread_team.h"
#include "formats/bake_file/bake_layout.h"
#include "formats/level/mesh.h"

namespace clamor {

namespace {

constexpr double kStep_m = 1e-3;
constexpr std::uint64_t kLargestRatio = 1000;
constexpr std::uint64_t kVertexBytes = 12, kTriangleBytes = 8;  // unpacked

std::uint64_t page_bytes(const GeometryCounts& counts) {
  return kVertexBytes * counts.vertices + kTriangleBytes * counts.triangles;
}

std::uint32_t to_zigzag(std::uint32_t value) { return value << 1 ^ (0u - (value >> 31)); }
std::uint32_t from_zigzag(std::uint32_t code) { return code >> 1 ^ (0u - (code & 1)); }

// Stores a column byte plane by byte plane, lowest bytes first.
void put_column(std::span<const std::uint32_t> numbers, int bytes_each,
                std::vector<std::byte>& bytes) {
  for (int k = 0; k < bytes_each; ++k)
    for (const std::uint32_t number : numbers)
      bytes.push_back(static_cast<std::byte>(number >> 8 * k & 255));
}

class ColumnReader {
 public:
  explicit ColumnReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::vector<std::uint32_t> next(std::size_t count, int bytes_each) {
    std::vector<std::uint32_t> numbers(count, 0);
    for (int k = 0; k < bytes_each; ++k, bytes_ = bytes_.subspan(count))
      for (std::size_t i = 0; i < count; ++i)
        numbers[i] |= static_cast<std::uint32_t>(bytes_[i]) << 8 * k;
    return numbers;
  }

 private:
  std::span<const std::byte> bytes_;
};

PackedGeometryPage pack_page(const Mesh& mesh, const Vec3& low_m, std::size_t first,
                             std::size_t last) {
  std::array<std::vector<std::uint32_t>, 3> positions, corners;
  std::vector<std::uint32_t> materials;
  std::unordered_map<std::uint32_t, std::uint32_t> numbers;  // indices in the page
  std::array<std::uint32_t, 3> before{};                     // millimetres above the low corner
  std::uint32_t material_before = 0;
  for (std::size_t t = first; t < last; ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t vertex = mesh.triangles[t][corner];
      const auto known = static_cast<std::uint32_t>(numbers.size());
      const auto [found, is_new] = numbers.try_emplace(vertex, known);
      corners[corner].push_back(is_new ? 0 : known - found->second);
      if (!is_new) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int i = static_cast<int>(axis);
        const double above_m = static_cast<double>(mesh.vertices_m[vertex][i]) - low_m[i];
        const auto steps =
            static_cast<std::uint32_t>(std::min(std::round(above_m / kStep_m), 4294967295.0));
        positions[axis].push_back(to_zigzag(steps - before[axis]));
        before[axis] = steps;
      }
    }
    const std::uint32_t material = mesh.materials[t];
    materials.push_back((material - material_before) & 0xffff);
    material_before = material;
  }
  std::vector<std::byte> bytes;
  for (const auto& column : positions) put_column(column, 4, bytes);
  for (const auto& column : corners) put_column(column, 2, bytes);
  put_column(materials, 2, bytes);
  return {{static_cast<std::uint32_t>(numbers.size()), static_cast<std::uint32_t>(last - first)},
          packed(bytes)};
}

// Packs triangles [first, last) as one page, or as two halves if its compression ratio were too
// high. Smaller pages have less repetition.
void pack_pages(const Mesh& mesh, const Vec3& low_m, std::size_t first, std::size_t last,
                std::vector<PackedGeometryPage>& pages) {
  PackedGeometryPage page = pack_page(mesh, low_m, first, last);
  if (is_geometry_page(page.counts, page.frame.size())) return pages.push_back(std::move(page));
  const std::size_t middle = first + (last - first) / 2;
  pack_pages(mesh, low_m, first, middle, pages);
  pack_pages(mesh, low_m, middle, last, pages);
}

}  // namespace

PackedGeometry pack_geometry(const Mesh& mesh) {
  PackedGeometry packed;
  if (mesh.triangles.empty()) return packed;
  packed.low_m = Vec3(bounds_of(mesh.vertices_m).low_m);
  const std::size_t triangles = mesh.triangles.size();
  std::vector<std::vector<PackedGeometryPage>> parts((triangles + kPageTriangles - 1) /
                                                     kPageTriangles);
  team_for(0, parts.size(), [&](std::size_t i) {
    const std::size_t first = i * kPageTriangles;
    pack_pages(mesh, packed.low_m, first, std::min(triangles, first + kPageTriangles), parts[i]);
  });
  for (auto& part : parts)
    for (PackedGeometryPage& page : part) packed.pages.push_back(std::move(page));
  return packed;
}

bool is_geometry_page(const GeometryCounts& counts, std::uint64_t packed_bytes) {
  return counts.triangles > 0 && counts.triangles <= kPageTriangles && counts.vertices > 0 &&
         counts.vertices <= 3 * counts.triangles &&
         page_bytes(counts) <= kLargestRatio * packed_bytes;
}

Result<Mesh> unpack_geometry_page(std::span<const std::byte> frame, const GeometryCounts& counts,
                                  const Vec3& low_m, std::size_t materials) {
  const auto bytes = unpacked(frame, memory_size(page_bytes(counts)));
  if (!bytes.ok()) return bytes.error();
  ColumnReader columns(*bytes);
  Mesh mesh;
  mesh.vertices_m.resize(counts.vertices);
  mesh.triangles.resize(counts.triangles);
  mesh.materials.resize(counts.triangles);
  for (int axis = 0; axis < 3; ++axis) {
    const auto differences = columns.next(counts.vertices, 4);
    std::uint32_t steps = 0;
    for (std::size_t i = 0; i < counts.vertices; ++i) {
      steps += from_zigzag(differences[i]);
      mesh.vertices_m[i][axis] = static_cast<float>(low_m[axis] + steps * kStep_m);
    }
  }
  std::array<std::vector<std::uint32_t>, 3> corners;
  for (auto& column : corners) column = columns.next(counts.triangles, 2);
  std::uint32_t known = 0;
  for (std::size_t t = 0; t < counts.triangles; ++t)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t ago = corners[corner][t];
      if (ago > known || (ago == 0 && known == counts.vertices))
        return Error("has a triangle with a corner that does not exist");
      mesh.triangles[t][corner] = known - ago;
      known += ago == 0 ? 1 : 0;
    }
  if (known != counts.vertices) return Error("has a vertex that no triangle names");
  std::uint32_t material = 0;
  const auto differences = columns.next(counts.triangles, 2);
  for (std::size_t t = 0; t < counts.triangles; ++t) {
    material = (material + differences[t]) & 0xffff;
    if (material >= materials) return Error("has a triangle of a material that does not exist");
    mesh.materials[t] = static_cast<std::uint16_t>(material);
  }
  return mesh;
}

void append(const Mesh& page, Mesh& mesh) {
  const auto before = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.insert(mesh.vertices_m.end(), page.vertices_m.begin(), page.vertices_m.end());
  mesh.materials.insert(mesh.materials.end(), page.materials.begin(), page.materials.end());
  for (const auto& corners : page.triangles)
    mesh.triangles.push_back({corners[0] + before, corners[1] + before, corners[2] + before});
}

Result<Mesh> unpack_whole_geometry(std::span<const std::byte> frame, const GeometryCounts& counts,
                                   const Vec3& low_m, std::size_t materials) {
  const std::uint64_t size =
      std::uint64_t{12} * counts.vertices + std::uint64_t{14} * counts.triangles;
  if (size > kLargestRatio * frame.size())
    return Error("claims to be " + std::to_string(size) + " bytes");
  const auto bytes = unpacked(frame, memory_size(size));
  if (!bytes.ok()) return bytes.error();
  const std::byte* at = bytes->data();
  const auto get = [&at]<class T>(T& value) {
    std::memcpy(&value, at, sizeof(value));
    at += sizeof(value);
  };
  Mesh mesh;
  mesh.vertices_m.resize(counts.vertices);
  mesh.triangles.resize(counts.triangles);
  mesh.materials.resize(counts.triangles);
  for (int axis = 0; axis < 3; ++axis)
    for (Vec3f& vertex : mesh.vertices_m) {
      std::uint32_t steps = 0;
      get(steps);
      vertex[axis] = static_cast<float>(low_m[axis] + steps * kStep_m);
    }
  for (std::size_t corner = 0; corner < 3; ++corner)
    for (auto& triangle : mesh.triangles) {
      get(triangle[corner]);
      if (triangle[corner] >= counts.vertices)
        return Error("has a triangle with a corner that does not exist");
    }
  for (auto& material : mesh.materials) {
    get(material);
    if (material >= materials) return Error("has a triangle of a material that does not exist");
  }
  return mesh;
}

}  // namespace clamor
