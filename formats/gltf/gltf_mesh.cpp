#include "formats/gltf/gltf_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "formats/gltf/gltf_accessor.h"
#include "formats/gltf/gltf_pose.h"

namespace clamor {

namespace {

constexpr double kFarthest_m = 1e6;
constexpr int kTriangles = 4, kFan = 6;

// A mesh in local coordinates, with only the vertices that its triangles use.
struct LocalMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint16_t> materials;
  std::size_t points_or_lines = 0, left_over = 0;
  double step = 0;      // of positions that are integers
  std::string unposed;  // what is wrong with its skin or shape keys; it has then no triangles
};

std::string label(const GltfScene& scene, std::size_t mesh) {
  const std::string& name = scene.meshes[mesh].name;
  return fmt::format("mesh {}{}", mesh, name.empty() ? "" : " " + in_quotes(name));
}

std::size_t triangle_count(int mode, std::size_t indices) {
  if (mode == kTriangles) return indices / 3;
  return indices < 3 ? 0 : indices - 2;
}

// Positions in the index list of the corners of triangle t. Every other triangle of a strip is
// reversed to keep the orientation.
std::array<std::size_t, 3> triangle_corners(int mode, std::size_t t) {
  if (mode == kTriangles) return {3 * t, 3 * t + 1, 3 * t + 2};
  if (mode == kFan) return {0, t + 1, t + 2};
  return {t, t + 1 + t % 2, t + 2 - t % 2};
}

class MeshReader {
 public:
  // Null surfaces: all triangles are read.
  MeshReader(const GltfScene& scene, const SceneSurfaces* surfaces)
      : scene_(scene), surfaces_(surfaces), pose_(scene) {}

  const GltfPose& pose() const { return pose_; }

  // The mesh of a node. Without a pose it is the same for all nodes that have it.
  Result<LocalMesh> read(int node) {
    const auto mesh = static_cast<std::size_t>(scene_.nodes[static_cast<std::size_t>(node)].mesh);
    const auto& primitives = scene_.meshes[mesh].primitives;
    LocalMesh local;
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      if (surfaces_ != nullptr && !surfaces_->is_material(primitives[p].material)) continue;
      std::optional<PrimitivePose> posed;
      if (pose_.moves(node) && primitives[p].positions() != kNone) {
        auto opened = pose_.open(node, p);
        if (!opened.ok()) {
          local.unposed = opened.error().message;
          break;
        }
        posed = std::move(*opened);
      }
      if (const auto ok = read(primitives[p], posed ? &*posed : nullptr, local); !ok.ok())
        return ok.error().in(label(scene_, mesh));
    }
    if (!local.unposed.empty()) local.triangles.clear();
    return local;
  }

 private:
  Result<void> read(const GltfPrimitive& primitive, const PrimitivePose* posed, LocalMesh& local) {
    if (primitive.mode < kTriangles) {
      ++local.points_or_lines;
      return {};
    }
    if (primitive.positions() == kNone) return {};  // glTF requires to skip such a primitive
    const auto positions = GltfReader::open(scene_, primitive.positions(), 3);
    if (!positions.ok()) return positions.error();
    std::optional<GltfReader> indices;
    if (primitive.indices != kNone) {
      if (!is_unsigned(scene_.accessors[static_cast<std::size_t>(primitive.indices)]))
        return Error(
            fmt::format("accessor {} holds indices but no unsigned integers; export the "
                        "level again.",
                        primitive.indices));
      auto reader = GltfReader::open(scene_, primitive.indices, 1);
      if (!reader.ok()) return reader.error();
      indices = std::move(*reader);
    }

    const std::size_t count = indices ? indices->count() : positions->count();
    const std::size_t triangles = triangle_count(primitive.mode, count);
    if (primitive.mode == kTriangles) local.left_over += count % 3;
    local.step = std::max(local.step, positions->step());
    begin_remap(positions->count());
    for (std::size_t t = 0; t < triangles; ++t) {
      std::array<std::uint32_t, 3> triangle;
      const auto places = triangle_corners(primitive.mode, t);
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t vertex = indices ? indices->index_at(places[c]) : places[c];
        if (vertex >= positions->count())
          return Error(fmt::format("has index {}, beyond its {} vertices; export the level again.",
                                   vertex, positions->count()));
        const auto known = local_vertex(*positions, vertex, posed, local);
        if (!known)
          return Error(
              fmt::format("vertex {} is not finite (NaN or infinite); repair the mesh.", vertex));
        triangle[c] = *known;
      }
      local.triangles.push_back(triangle);
      local.materials.push_back(static_cast<std::uint16_t>(
          primitive.material == kNone ? static_cast<int>(scene_.materials.size())
                                      : primitive.material));
    }
    return {};
  }

  // The remap table is reused between primitives; entries are valid only if the current primitive
  // wrote them, so the cost of a primitive depends only on the vertices that it uses.
  void begin_remap(std::size_t vertices) {
    if (remap_.size() < vertices) remap_.resize(vertices);
    ++round_;
  }

  // Index of a vertex in `local`, where it is added at its first use; none if it is not finite.
  std::optional<std::uint32_t> local_vertex(const GltfReader& positions, std::size_t vertex,
                                            const PrimitivePose* posed, LocalMesh& local) {
    auto& [round, place] = remap_[vertex];
    if (round != round_) {
      const auto p = positions.at(vertex);
      Vec3 position(p[0], p[1], p[2]);
      if (posed != nullptr) {
        const auto moved = posed->moved(vertex, position);
        if (!moved)
          local.unposed =
              fmt::format("vertex {} has no weight, or a joint that is not there", vertex);
        position = moved.value_or(Vec3(0));
      }
      if (!is_finite(position)) return std::nullopt;
      round = round_;
      place = static_cast<std::uint32_t>(local.vertices.size());
      local.vertices.push_back(position);
    }
    return place;
  }

  const GltfScene& scene_;
  const SceneSurfaces* surfaces_;
  GltfPose pose_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> remap_;  // primitive number, index
  std::uint32_t round_ = 0;
};

Result<void> append(const LocalMesh& local, const glm::dmat4& place, Mesh& mesh, SceneMesh& out) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  // Each of the two vertices is off by half a step, in all three directions.
  const auto columns = glm::dmat3(place);
  const double scale = std::sqrt(dot(columns[0], columns[0]) + dot(columns[1], columns[1]) +
                                 dot(columns[2], columns[2]));
  out.rounding_m = std::max(out.rounding_m, local.step * scale);
  for (const Vec3& vertex : local.vertices) {
    const Vec3 p(place * glm::dvec4(vertex, 1.0));
    if (!(std::fabs(p.x) <= kFarthest_m && std::fabs(p.y) <= kFarthest_m &&
          std::fabs(p.z) <= kFarthest_m))
      return Error(
          fmt::format("a vertex lies {:g} km from the middle of the level, where 1000 km are the "
                      "most; glTF is in metres: scale the level or repair it.",
                      length(p) / 1000));
    mesh.vertices_m.emplace_back(p);
  }
  for (std::size_t t = 0; t < local.triangles.size(); ++t) {
    std::array<std::uint32_t, 3> triangle = local.triangles[t];
    for (auto& corner : triangle) corner += first;
    const Vec3 a(mesh.vertices_m[triangle[0]]), b(mesh.vertices_m[triangle[1]]),
        c(mesh.vertices_m[triangle[2]]);
    if (length(cross(b - a, c - a)) == 0) {
      ++out.degenerate;
      continue;
    }
    mesh.triangles.push_back(triangle);
    mesh.materials.push_back(local.materials[t]);
  }
  return {};
}

// Number of triangles of a mesh, from validated accessors.
Result<std::uint64_t> count_triangles(const GltfScene& scene, const SceneSurfaces& surfaces,
                                      std::size_t mesh) {
  std::uint64_t count = 0;
  for (const GltfPrimitive& primitive : scene.meshes[mesh].primitives) {
    const bool indexed = primitive.indices != kNone;
    const int accessor = indexed ? primitive.indices : primitive.positions();
    if (primitive.mode < kTriangles || accessor == kNone ||
        !surfaces.is_material(primitive.material))
      continue;
    const auto reader = GltfReader::open(scene, accessor, indexed ? 1 : 3);
    if (!reader.ok()) return reader.error().in(label(scene, mesh));
    count += triangle_count(primitive.mode, reader->count());
  }
  return count;
}

// Checks the total before any triangle is created, because instancing lets a small file demand any
// number.
Result<void> check_total(const GltfScene& scene, const std::vector<PlacedNode>& placements,
                         const SceneSurfaces& surfaces) {
  std::map<int, std::uint64_t> per_mesh;
  std::uint64_t total = 0;
  for (const PlacedNode& placement : placements) {
    const int mesh = scene.nodes[static_cast<std::size_t>(placement.node)].mesh;
    if (mesh == kNone || placement.portal || !surfaces.is_surface(placement.node)) continue;
    auto known = per_mesh.find(mesh);
    if (known == per_mesh.end()) {
      const auto count = count_triangles(scene, surfaces, static_cast<std::size_t>(mesh));
      if (!count.ok()) return count.error();
      known = per_mesh.emplace(mesh, *count).first;
    }
    total += known->second;
    if (total > kMaxTriangles)
      return Error(
          fmt::format("the level has more than {} triangles, instances counted, the most "
                      "that are read; simplify or split it.",
                      kMaxTriangles));
  }
  return {};
}

}  // namespace

Result<SceneMesh> build_mesh(const GltfScene& scene, const std::vector<PlacedNode>& placements,
                             const MovableNodes& movable, const SceneSurfaces& surfaces) {
  SceneMesh out;
  out.parts.resize(movable.parts.size());
  std::size_t movable_triangles = 0;
  if (scene.materials.size() >= std::numeric_limits<std::uint16_t>::max())
    return Error(fmt::format("has {} materials; at most 65534 are read.", scene.materials.size()));
  if (const auto ok = check_total(scene, placements, surfaces); !ok.ok()) return ok.error();

  MeshReader reader(scene, &surfaces);
  const GltfPose& pose = reader.pose();
  // By mesh, and by node if a pose moves it: each is read once, however often it is placed.
  std::map<std::pair<int, int>, LocalMesh> local_meshes;
  for (const PlacedNode& placement : placements) {
    const int mesh = scene.nodes[static_cast<std::size_t>(placement.node)].mesh;
    if (mesh == kNone || placement.portal || !surfaces.is_surface(placement.node)) continue;
    const std::pair key(mesh, pose.moves(placement.node) ? placement.node : kNone);
    auto found = local_meshes.find(key);
    if (found == local_meshes.end()) {
      auto local = reader.read(placement.node);
      if (!local.ok()) return local.error();
      const std::string& name = scene.nodes[static_cast<std::size_t>(placement.node)].name;
      if (!local->unposed.empty()) out.unposed.push_back(in_quotes(name) + ": " + local->unposed);
      if (pose.is_skinned(placement.node)) out.skinned.push_back(placement.node);
      if (pose.has_keys(placement.node)) out.keyed.push_back(placement.node);
      out.points_or_lines += local->points_or_lines;
      out.left_over += local->left_over;
      if (!local->triangles.empty()) ++out.meshes;
      found = local_meshes.emplace(key, std::move(*local)).first;
    }
    if (found->second.triangles.empty()) continue;
    ++out.placements;
    const int part = movable.part_of[static_cast<std::size_t>(placement.node)];
    const auto p = static_cast<std::size_t>(part);
    if (part != kNone) movable_triangles += found->second.triangles.size();
    if (movable_triangles > kMaxMovableTriangles)
      return Error(fmt::format("the movable parts have more than {} triangles; simplify them.",
                               kMaxMovableTriangles));
    const std::size_t first_vertex = out.mesh.vertices_m.size(),
                      first_triangle = out.mesh.triangles.size();
    // A skin places its vertices in the world.
    const glm::dmat4 place = pose.is_skinned(placement.node)
                                 ? glm::translate(glm::dmat4(1.0), -scene.origin_m)
                                 : placement.world;
    const auto ok = part == kNone
                        ? append(found->second, place, out.mesh, out)
                        : append(found->second, glm::affineInverse(movable.parts[p].world) * place,
                                 out.parts[p], out);
    if (!ok.ok()) return ok.error().in(label(scene, static_cast<std::size_t>(mesh)));
    if (part == kNone)
      out.placed.push_back({placement.node, first_vertex, out.mesh.vertices_m.size(),
                            first_triangle, out.mesh.triangles.size()});
  }
  return out;
}

void remove_placed(SceneMesh& mesh, const std::function<bool(std::size_t)>& goes) {
  SceneMesh kept;
  for (std::size_t p = 0; p < mesh.placed.size(); ++p) {
    if (goes(p)) continue;
    PlacedTriangles placed = mesh.placed[p];
    const std::size_t vertices = kept.mesh.vertices_m.size(),
                      triangles = kept.mesh.triangles.size();
    for (std::size_t v = placed.first_vertex; v < placed.end_vertex; ++v)
      kept.mesh.vertices_m.push_back(mesh.mesh.vertices_m[v]);
    for (std::size_t t = placed.first_triangle; t < placed.end_triangle; ++t) {
      auto triangle = mesh.mesh.triangles[t];
      for (auto& corner : triangle)
        corner = static_cast<std::uint32_t>(corner - placed.first_vertex + vertices);
      kept.mesh.triangles.push_back(triangle);
      kept.mesh.materials.push_back(mesh.mesh.materials[t]);
    }
    kept.placed.push_back({placed.node, vertices, kept.mesh.vertices_m.size(), triangles,
                           kept.mesh.triangles.size()});
  }
  mesh.mesh = std::move(kept.mesh);
  mesh.placed = std::move(kept.placed);
}

Result<Mesh> placed_mesh(const GltfScene& scene, const PlacedNode& placement) {
  const auto local = MeshReader(scene, nullptr).read(placement.node);
  if (!local.ok()) return local.error();
  SceneMesh out;
  if (const auto ok = append(*local, placement.world, out.mesh, out); !ok.ok()) return ok.error();
  return std::move(out.mesh);
}

}  // namespace clamor
