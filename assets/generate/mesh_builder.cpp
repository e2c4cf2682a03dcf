#include "mesh_builder.h"

namespace clamor::assets {

std::uint32_t MeshBuilder::weld(MaterialIndex material, const Vec3& corner_m) {
  // Adding zero turns -0 into 0, so that both weld.
  const Vec3f corner = Vec3f(corner_m) + Vec3f(0);
  Part& part = parts_[material];
  const auto next = static_cast<std::uint32_t>(part.vertices_m.size());
  const auto [it, is_new] = corners_.try_emplace({material, {corner.x, corner.y, corner.z}}, next);
  if (is_new) part.vertices_m.push_back(corner);
  return it->second;
}

void MeshBuilder::triangle(MaterialIndex material, const Vec3& a, const Vec3& b, const Vec3& c) {
  if (length(cross(b - a, c - a)) < 1e-7) return;
  const std::uint32_t ia = weld(material, a), ib = weld(material, b), ic = weld(material, c);
  std::vector<std::uint32_t>& indices = parts_[material].indices;
  indices.insert(indices.end(), {ia, ib, ic});
}

void MeshBuilder::quad(MaterialIndex material, const Vec3& a, const Vec3& b, const Vec3& c,
                       const Vec3& d) {
  triangle(material, a, b, c);
  triangle(material, a, c, d);
}

void MeshBuilder::hexahedron(MaterialIndex material, const std::array<Vec3, 8>& corners,
                             Bottom bottom) {
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t j = (i + 1) % 4;
    quad(material, corners[i], corners[j], corners[j + 4], corners[i + 4]);
  }
  quad(material, corners[4], corners[5], corners[6], corners[7]);
  if (bottom == Bottom::kClosed) quad(material, corners[3], corners[2], corners[1], corners[0]);
}

void MeshBuilder::box(MaterialIndex material, const Vec3& low_m, const Vec3& high_m,
                      Bottom bottom) {
  const Vec3 &l = low_m, &h = high_m;
  hexahedron(material,
             {Vec3(l.x, l.y, h.z), Vec3(h.x, l.y, h.z), Vec3(h.x, l.y, l.z), Vec3(l.x, l.y, l.z),
              Vec3(l.x, h.y, h.z), Vec3(h.x, h.y, h.z), Vec3(h.x, h.y, l.z), Vec3(l.x, h.y, l.z)},
             bottom);
}

void MeshBuilder::prism(MaterialIndex material, std::span<const glm::dvec2> outline_m,
                        double low_y_m, double high_y_m) {
  glm::dvec2 mean(0);
  for (const glm::dvec2& p : outline_m) mean += p / static_cast<double>(outline_m.size());
  const auto at = [](const glm::dvec2& p, double y_m) { return Vec3(p.x, y_m, p.y); };
  for (std::size_t i = 0; i < outline_m.size(); ++i) {
    const glm::dvec2 &p = outline_m[i], &q = outline_m[(i + 1) % outline_m.size()];
    quad(material, at(p, low_y_m), at(q, low_y_m), at(q, high_y_m), at(p, high_y_m));
    triangle(material, at(mean, high_y_m), at(p, high_y_m), at(q, high_y_m));
    triangle(material, at(mean, low_y_m), at(q, low_y_m), at(p, low_y_m));
  }
}

std::size_t MeshBuilder::triangle_count() const {
  std::size_t count = 0;
  for (const auto& [material, part] : parts_) count += part.indices.size() / 3;
  return count;
}

}  // namespace clamor::assets
