#include "tools/view/level_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <tuple>
#include <utility>

#include "formats/files/level_folder.h"
#include "formats/gltf/gltf_document.h"
#include "formats/gltf/texture_colour.h"

namespace clamor {

namespace {

// Muted, of about the same lightness, so that shading tells shapes.
constexpr std::array<std::array<float, 3>, 10> kPalette = {{{0.56f, 0.54f, 0.50f},
                                                            {0.47f, 0.52f, 0.56f},
                                                            {0.58f, 0.49f, 0.42f},
                                                            {0.49f, 0.55f, 0.47f},
                                                            {0.55f, 0.50f, 0.56f},
                                                            {0.60f, 0.56f, 0.44f},
                                                            {0.44f, 0.53f, 0.53f},
                                                            {0.57f, 0.46f, 0.46f},
                                                            {0.50f, 0.50f, 0.58f},
                                                            {0.52f, 0.52f, 0.52f}}};

using Place = std::array<std::int64_t, 3>;  // tenths of a millimetre

Place place_of(const Vec3f& position_m) {
  Place place;
  for (int i = 0; i < 3; ++i)
    place[static_cast<std::size_t>(i)] = std::llround(static_cast<double>(position_m[i]) * 1e4);
  return place;
}

struct Edge {
  Place a, b;
  auto operator<=>(const Edge&) const = default;
};

Edge edge_of(const Mesh& mesh, std::uint32_t triangle, std::size_t side) {
  const auto& corners = mesh.triangles[triangle];
  Edge edge{place_of(mesh.vertices_m[corners[side]]),
            place_of(mesh.vertices_m[corners[(side + 1) % 3]])};
  if (edge.b < edge.a) std::swap(edge.a, edge.b);
  return edge;
}

Vec3f normal_of(const Mesh& mesh, std::uint32_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Vec3f normal =
      cross(mesh.vertices_m[b] - mesh.vertices_m[a], mesh.vertices_m[c] - mesh.vertices_m[a]);
  const float size = length(normal);
  return size > 0 ? normal / size : Vec3f(0, 1, 0);
}

std::optional<Vec3f> colour_in(const Json* factor) {
  if (factor == nullptr || factor->array() == nullptr || factor->array()->size() < 3)
    return std::nullopt;
  Vec3f colour(1);
  for (int i = 0; i < 3; ++i)
    if (const double* value = (*factor->array())[static_cast<std::size_t>(i)].number())
      colour[i] = static_cast<float>(std::clamp(*value, 0.0, 1.0));
  return colour;
}

// Mean colours of the textures of a document, each image decoded once.
class TextureColours {
 public:
  TextureColours(const GltfScene& scene, LevelFolder& folder) : scene_(scene), folder_(folder) {}

  // `index`: of a texture; null: none.
  std::optional<Vec3f> mean(const Json* index) {
    const Json* const image = texture_image(scene_.json, index);
    if (image == nullptr) return std::nullopt;
    const auto [known, is_new] = means_.try_emplace(image);
    if (is_new)
      if (const auto means = image_means(scene_, *image, folder_)) known->second = means->colour;
    return known->second;
  }

 private:
  const GltfScene& scene_;
  LevelFolder& folder_;
  std::map<const Json*, std::optional<Vec3f>> means_;  // by image
};

}  // namespace

std::map<std::string, Vec3f> base_colours(const std::string& level_path) {
  std::map<std::string, Vec3f> colours;
  LevelFolder folder(level_path);
  const auto scene = read_gltf_document(level_path, folder);
  if (!scene.ok()) return colours;
  TextureColours textures(*scene, folder);
  for (const Json& material : scene->json.list("materials")) {
    const std::string name = material.text("name");
    if (name.empty()) continue;
    const auto factor = colour_in(material.find({"pbrMetallicRoughness", "baseColorFactor"}));
    const auto texture =
        textures.mean(material.find({"pbrMetallicRoughness", "baseColorTexture", "index"}));
    if (factor || texture) colours[name] = factor.value_or(Vec3f(1)) * texture.value_or(Vec3f(1));
  }
  return colours;
}

std::vector<Vec3f> colours_of(std::span<const Material> materials,
                              const std::map<std::string, Vec3f>& base_colours) {
  std::vector<Vec3f> colours;
  for (const Material& material : materials) {
    const auto known = base_colours.find(material.name);
    const auto& spare = kPalette[colours.size() % kPalette.size()];
    colours.push_back(known != base_colours.end() ? known->second
                                                  : Vec3f(spare[0], spare[1], spare[2]));
  }
  return colours;
}

std::vector<ShadedVertex> shade(const Mesh& mesh, std::span<const Vec3f> colours) {
  std::vector<ShadedVertex> vertices;
  vertices.reserve(3 * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3f normal = normal_of(mesh, t);
    const std::uint16_t material = mesh.materials[t];
    for (const std::uint32_t corner : mesh.triangles[t])
      vertices.push_back(
          {mesh.vertices_m[corner], normal, colours[material], static_cast<float>(material)});
  }
  return vertices;
}

std::vector<std::uint32_t> surface_of(const Mesh& mesh, std::uint32_t triangle) {
  std::map<Edge, std::vector<std::uint32_t>> sides;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    if (mesh.materials[t] == mesh.materials[triangle])
      for (std::size_t side = 0; side < 3; ++side) sides[edge_of(mesh, t, side)].push_back(t);
  std::vector<bool> is_in(mesh.triangles.size());
  std::vector<std::uint32_t> surface{triangle};
  is_in[triangle] = true;
  for (std::size_t next = 0; next < surface.size(); ++next)
    for (std::size_t side = 0; side < 3; ++side)
      for (const std::uint32_t other : sides[edge_of(mesh, surface[next], side)])
        if (!is_in[other]) {
          is_in[other] = true;
          surface.push_back(other);
        }
  std::ranges::sort(surface);
  return surface;
}

std::vector<Vec3f> outline_of(const Mesh& mesh, std::span<const std::uint32_t> surface) {
  constexpr float kFlat = 0.9f;  // cosine
  struct Side {
    std::uint32_t triangle;
    std::size_t side;
    bool is_drawn = true;
  };
  std::map<Edge, Side> sides;
  for (const std::uint32_t t : surface)
    for (std::size_t side = 0; side < 3; ++side) {
      const auto [known, is_new] = sides.try_emplace(edge_of(mesh, t, side), Side{t, side});
      if (!is_new &&
          std::abs(dot(normal_of(mesh, t), normal_of(mesh, known->second.triangle))) > kFlat)
        known->second.is_drawn = false;
    }
  std::vector<Vec3f> ends;
  for (const auto& [edge, side] : sides) {
    if (!side.is_drawn) continue;
    const auto& corners = mesh.triangles[side.triangle];
    ends.push_back(mesh.vertices_m[corners[side.side]]);
    ends.push_back(mesh.vertices_m[corners[(side.side + 1) % 3]]);
  }
  return ends;
}

// Tomas Moeller, Ben Trumbore. Fast, Minimum Storage Ray-Triangle Intersection. J. Graphics Tools
// 2(1), 1997.
PickedTriangle pick(const Mesh& mesh, const Vec3& origin_m, const Vec3& direction) {
  PickedTriangle picked;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 a(mesh.vertices_m[mesh.triangles[t][0]]);
    const Vec3 ab = Vec3(mesh.vertices_m[mesh.triangles[t][1]]) - a;
    const Vec3 ac = Vec3(mesh.vertices_m[mesh.triangles[t][2]]) - a;
    const Vec3 p = cross(direction, ac);
    const double determinant = dot(ab, p);
    if (determinant == 0) continue;
    const Vec3 from_a = origin_m - a, q = cross(from_a, ab);
    const double u = dot(from_a, p) / determinant, v = dot(direction, q) / determinant;
    const double distance_m = dot(ac, q) / determinant;
    if (u < 0 || v < 0 || u + v > 1 || distance_m < 1e-3) continue;
    if (picked.triangle == SIZE_MAX || distance_m < picked.distance_m) picked = {t, distance_m};
  }
  return picked;
}

double free_m(const Mesh& mesh, const Vec3& from_m, const Vec3& direction, double max_m) {
  const PickedTriangle hit = pick(mesh, from_m, direction);
  return hit.triangle == SIZE_MAX ? max_m : std::min(max_m, hit.distance_m);
}

std::size_t pick_point(std::span<const Vec3> points_m, const Vec3& origin_m, const Vec3& direction,
                       double limit_m) {
  constexpr double kRadius_m = 0.15, kRadius_rad = 0.02;
  std::size_t best = SIZE_MAX;
  double nearest_m = limit_m;
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    const Vec3 to = points_m[i] - origin_m;
    const double along_m = dot(to, direction);
    if (along_m <= 0 || along_m > nearest_m + kRadius_m) continue;
    if (length(to - along_m * direction) > std::max(kRadius_m, kRadius_rad * along_m)) continue;
    best = i;
    nearest_m = along_m;
  }
  return best;
}

}  // namespace clamor
