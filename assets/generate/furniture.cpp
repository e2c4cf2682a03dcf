#include "furniture.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace clamor::assets {

namespace {

constexpr auto kOpen = MeshBuilder::Bottom::kOpen;

void add_legs(MeshBuilder& mesh, MaterialIndex material, const Vec3& low_m, const Vec3& high_m,
              double thickness_m) {
  for (const double x : {low_m.x, high_m.x - thickness_m})
    for (const double z : {low_m.z, high_m.z - thickness_m})
      mesh.box(material, {x, low_m.y, z}, {x + thickness_m, high_m.y, z + thickness_m}, kOpen);
}

}  // namespace

MeshBuilder make_chair(const FurnitureMaterials& m) {
  MeshBuilder mesh;
  mesh.box(m.upholstery, {-0.24, 0.40, -0.22}, {0.24, 0.49, 0.24});
  mesh.hexahedron(m.wood,
                  {Vec3(-0.23, 0.56, 0.26), Vec3(0.23, 0.56, 0.26), Vec3(0.23, 0.56, 0.20),
                   Vec3(-0.23, 0.56, 0.20), Vec3(-0.23, 0.98, 0.34), Vec3(0.23, 0.98, 0.34),
                   Vec3(0.23, 0.98, 0.29), Vec3(-0.23, 0.98, 0.29)},
                  MeshBuilder::Bottom::kClosed);
  for (const double x : {-0.21, 0.18}) mesh.box(m.metal, {x, 0.49, 0.20}, {x + 0.03, 0.57, 0.23});
  add_legs(mesh, m.metal, {-0.22, 0, -0.20}, {0.22, 0.40, 0.22}, 0.03);
  return mesh;
}

// Head, trunk, legs and the two arms that hold violin and bow; the violin itself, small and thin.
MeshBuilder make_violinist(const FurnitureMaterials& m) {
  MeshBuilder mesh;
  for (const double x : {-0.19, 0.03})
    mesh.box(m.person, {x, 0, -0.09}, {x + 0.16, 0.88, 0.09}, kOpen);
  mesh.hexahedron(m.person,
                  {Vec3(-0.18, 0.88, 0.11), Vec3(0.18, 0.88, 0.11), Vec3(0.18, 0.88, -0.11),
                   Vec3(-0.18, 0.88, -0.11), Vec3(-0.22, 1.46, 0.11), Vec3(0.22, 1.46, 0.11),
                   Vec3(0.22, 1.46, -0.10), Vec3(-0.22, 1.46, -0.10)},
                  MeshBuilder::Bottom::kClosed);
  mesh.box(m.person, {-0.09, 1.50, -0.11}, {0.09, 1.76, 0.10});
  mesh.box(m.person, {-0.30, 1.16, -0.30}, {-0.22, 1.42, 0.04});
  mesh.box(m.person, {0.22, 1.16, -0.30}, {0.30, 1.42, 0.04});
  mesh.hexahedron(m.lacquer,
                  {Vec3(-0.12, 1.40, -0.14), Vec3(0.02, 1.40, -0.14), Vec3(-0.16, 1.36, -0.46),
                   Vec3(-0.26, 1.36, -0.46), Vec3(-0.12, 1.44, -0.14), Vec3(0.02, 1.44, -0.14),
                   Vec3(-0.16, 1.40, -0.46), Vec3(-0.26, 1.40, -0.46)},
                  MeshBuilder::Bottom::kClosed);
  return mesh;
}

MeshBuilder make_lectern(const FurnitureMaterials& m) {
  MeshBuilder mesh;
  mesh.box(m.wood, {-0.30, 0, -0.20}, {0.30, 0.06, 0.25}, kOpen);
  mesh.box(m.wood, {-0.24, 0.06, -0.16}, {0.24, 1.00, 0.14}, kOpen);
  mesh.hexahedron(m.wood,
                  {Vec3(-0.34, 1.00, 0.26), Vec3(0.34, 1.00, 0.26), Vec3(0.34, 1.12, -0.22),
                   Vec3(-0.34, 1.12, -0.22), Vec3(-0.34, 1.04, 0.26), Vec3(0.34, 1.04, 0.26),
                   Vec3(0.34, 1.16, -0.22), Vec3(-0.34, 1.16, -0.22)},
                  MeshBuilder::Bottom::kClosed);
  return mesh;
}

MeshBuilder make_music_stand(const FurnitureMaterials& m) {
  MeshBuilder mesh;
  mesh.box(m.metal, {-0.18, 0, -0.18}, {0.18, 0.02, 0.18}, kOpen);
  mesh.box(m.metal, {-0.015, 0.02, -0.015}, {0.015, 1.00, 0.015}, kOpen);
  mesh.hexahedron(m.metal,
                  {Vec3(-0.25, 0.95, 0.06), Vec3(0.25, 0.95, 0.06), Vec3(0.25, 0.95, 0.05),
                   Vec3(-0.25, 0.95, 0.05), Vec3(-0.25, 1.28, -0.09), Vec3(0.25, 1.28, -0.09),
                   Vec3(0.25, 1.28, -0.10), Vec3(-0.25, 1.28, -0.10)},
                  MeshBuilder::Bottom::kClosed);
  return mesh;
}

MeshBuilder make_piano(const FurnitureMaterials& m) {
  MeshBuilder mesh;
  // Straight bass side along +Z, curved treble side; the keyboard at -X.
  const std::array<glm::dvec2, 9> outline = {{{0.00, 0.74},
                                              {1.72, 0.74},
                                              {1.86, 0.62},
                                              {1.88, 0.34},
                                              {1.76, 0.12},
                                              {1.40, -0.06},
                                              {1.06, -0.30},
                                              {0.70, -0.70},
                                              {0.00, -0.74}}};
  mesh.prism(m.lacquer, outline, 0.62, 0.96);
  mesh.box(m.lacquer, {-0.28, 0.60, -0.74}, {0, 0.76, 0.74});
  for (const glm::dvec2& leg : {glm::dvec2(0.05, -0.60), {0.05, 0.60}, {1.60, 0.30}})
    mesh.box(m.lacquer, {leg.x - 0.06, 0, leg.y - 0.06}, {leg.x + 0.06, 0.62, leg.y + 0.06}, kOpen);

  // The lid, hinged along the bass side and propped open.
  const auto raised = [](double x, double z, double above) {
    return Vec3(x, 0.98 + (0.74 - z) * 0.62 + above, z);
  };
  mesh.hexahedron(m.lacquer,
                  {raised(0.35, 0.74, 0), raised(1.80, 0.74, 0), raised(1.40, -0.06, 0),
                   raised(0.35, -0.72, 0), raised(0.35, 0.74, 0.03), raised(1.80, 0.74, 0.03),
                   raised(1.40, -0.06, 0.03), raised(0.35, -0.72, 0.03)},
                  MeshBuilder::Bottom::kClosed);

  mesh.box(m.upholstery, {-0.98, 0.44, -0.40}, {-0.60, 0.50, 0.40});
  add_legs(mesh, m.lacquer, {-0.96, 0, -0.38}, {-0.62, 0.44, 0.38}, 0.05);
  return mesh;
}

MeshBuilder make_table(const FurnitureMaterials& m, double width_m, double depth_m) {
  MeshBuilder mesh;
  const double x = width_m / 2, z = depth_m / 2;
  mesh.box(m.wood, {-x, 0.70, -z}, {x, 0.74, z});
  add_legs(mesh, m.metal, {-x + 0.05, 0, -z + 0.05}, {x - 0.05, 0.70, z - 0.05}, 0.05);
  return mesh;
}

// Against a wall at +Z, open towards -Z, with books of unequal depth in it.
MeshBuilder make_shelf(const FurnitureMaterials& m) {
  MeshBuilder mesh;
  constexpr double kWidth_m = 1.2, kDepth_m = 0.34, kHeight_m = 2.0, kBoard_m = 0.03;
  constexpr int kShelves = 5;
  const double x = kWidth_m / 2, pitch_m = (kHeight_m - kBoard_m) / kShelves;
  mesh.box(m.wood, {-x, 0, -0.02}, {x, kHeight_m, 0}, kOpen);
  for (const double side : {-x - kBoard_m, x})
    mesh.box(m.wood, {side, 0, -kDepth_m}, {side + kBoard_m, kHeight_m, 0}, kOpen);
  for (int i = 0; i <= kShelves; ++i)
    mesh.box(m.wood, {-x, i * pitch_m, -kDepth_m}, {x, i * pitch_m + kBoard_m, -0.02});
  for (int i = 0; i < kShelves; ++i) {
    for (int part = 0; part < 4; ++part) {
      const double from = -x + 0.02 + part * 0.29, deep = 0.16 + 0.03 * ((i * 3 + part * 2) % 5);
      const double high = 0.20 + 0.03 * ((i * 2 + part * 3) % 5), foot = i * pitch_m + kBoard_m;
      mesh.box(m.person, {from, foot, -deep}, {from + 0.26, foot + high, -0.02}, kOpen);
    }
  }
  return mesh;
}

MeshBuilder make_drape(const FurnitureMaterials& m, double width_m, double height_m) {
  MeshBuilder mesh;
  constexpr double kPleat_m = 0.09, kDepth_m = 0.07, kThickness_m = 0.004;
  const int folds = std::max(2, static_cast<int>(std::lround(width_m / kPleat_m)));
  const auto at = [&](int fold, double up_m, double back_m) {
    return Vec3((fold % 2 ? kDepth_m / 2 : -kDepth_m / 2) + back_m, up_m, width_m * fold / folds);
  };
  const double t = kThickness_m, h = height_m;
  for (int i = 0; i < folds; ++i) {
    mesh.quad(m.curtain, at(i, 0, 0), at(i + 1, 0, 0), at(i + 1, h, 0), at(i, h, 0));
    mesh.quad(m.curtain, at(i + 1, 0, t), at(i, 0, t), at(i, h, t), at(i + 1, h, t));
    mesh.quad(m.curtain, at(i, h, 0), at(i + 1, h, 0), at(i + 1, h, t), at(i, h, t));
    mesh.quad(m.curtain, at(i, 0, t), at(i + 1, 0, t), at(i + 1, 0, 0), at(i, 0, 0));
  }
  for (const int end : {0, folds})
    mesh.quad(m.curtain, at(end, 0, t), at(end, 0, 0), at(end, h, 0), at(end, h, t));
  return mesh;
}

}  // namespace clamor::assets
