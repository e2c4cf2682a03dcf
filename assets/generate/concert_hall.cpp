#include "concert_hall.h"

#include <algorithm>
#include <cmath>

#include "gltf_writer.h"
#include "room_shell.h"

namespace clamor::assets {

namespace {

constexpr double kStage_m = 1.1;

struct HallMaterials {
  MaterialIndex floor, plaster, wood, stage, seats;
};

HallMaterials hall_materials(GltfWriter& gltf) {
  const Bands smooth = same_in_all_bands(0.1f);
  HallMaterials m{};
  m.floor = gltf.material("parquet", {0.42, 0.25, 0.13, 0.5},
                          {0.04f, 0.04f, 0.05f, 0.06f, 0.07f, 0.07f, 0.07f, 0.07f}, smooth);
  m.plaster = gltf.material("smooth_plaster", {0.90, 0.88, 0.82},
                            {0.14f, 0.12f, 0.10f, 0.08f, 0.08f, 0.08f, 0.08f, 0.08f}, smooth);
  m.wood = gltf.material("wood_panels", {0.40, 0.22, 0.10, 0.6},
                         {0.22f, 0.20f, 0.16f, 0.12f, 0.10f, 0.09f, 0.09f, 0.09f}, smooth);
  m.stage = gltf.material("stage", {0.45, 0.30, 0.16, 0.5},
                          {0.18f, 0.16f, 0.12f, 0.10f, 0.09f, 0.08f, 0.08f, 0.08f}, smooth);
  m.seats = gltf.material("occupied_seats", {0.35, 0.06, 0.08},
                          {0.30f, 0.45f, 0.60f, 0.75f, 0.85f, 0.85f, 0.80f, 0.75f}, smooth);
  return m;
}

// The hall's planes: walls, niches and coffers.
const ShellGrid& hall_grid() {
  static const ShellGrid planes{{-10, -6.5, -2.5, 2.5, 6.5, 10},
                                {0, 1.8, 6.6, 8.4, 13.2, 15},
                                {-20, -16, -12, -8, -4, 0, 4, 8, 12, 16, 20}};
  return planes;
}

Cell hall_wall(const HallMaterials& m, Side side, const Vec3& middle_m) {
  const auto bay = static_cast<int>(std::floor(middle_m.z / 4));
  const bool is_between = middle_m.y > 1.8 && (middle_m.y < 6.6 || middle_m.y > 8.4);
  switch (side) {
    case Side::kFloor:
      return {m.floor};
    case Side::kCeiling:
      return {m.plaster, bay % 2 == 0 && std::abs(middle_m.x) < 6.5 ? 0.5 : 0};
    case Side::kLeft:
    case Side::kRight:
      return {middle_m.y < 1.8 ? m.wood : m.plaster,
              bay % 2 == 0 && is_between && middle_m.y < 13.2 ? 0.3 : 0};
    case Side::kFront:
    case Side::kBack:
      return {middle_m.y < 6.6 ? m.wood : m.plaster};
  }
  return {m.plaster};
}

MeshBuilder make_hall_fixtures(const HallMaterials& m) {
  using Bottom = MeshBuilder::Bottom;
  MeshBuilder mesh;
  mesh.box(m.stage, {-8, 0, -19.9}, {8, kStage_m, -9.5}, Bottom::kOpen);
  for (int row = 0; row < 24; ++row) {
    const double z_m = -7.5 + 1.05 * row, high_m = 0.8 + 0.04 * row;
    mesh.box(m.seats, {-8.6, 0, z_m}, {-0.8, high_m, z_m + 0.95}, Bottom::kOpen);
    mesh.box(m.seats, {0.8, 0, z_m}, {8.6, high_m, z_m + 0.95}, Bottom::kOpen);
  }
  for (const double side : {-1.0, 1.0}) {
    const double wall_m = side * 9.95, edge_m = side * 8.2;
    const double low_x = std::min(wall_m, edge_m), high_x = std::max(wall_m, edge_m);
    mesh.box(m.wood, {low_x, 7, -8}, {high_x, 7.3, 19.95});
  }
  mesh.box(m.wood, {-8.1, 7, 16}, {8.1, 7.3, 19.95});
  return mesh;
}

}  // namespace

std::string make_concert_hall() {
  GltfWriter gltf("concert_hall");
  const HallMaterials materials = hall_materials(gltf);
  const MeshBuilder walls = make_shell(
      hall_grid(), materials.plaster,
      [&](Side side, const Vec3& middle_m) { return hall_wall(materials, side, middle_m); });
  gltf.node("hall", gltf.mesh("hall", walls));
  gltf.node("fixtures", gltf.mesh("fixtures", make_hall_fixtures(materials)));
  const EmitterNode violin{
      .sound_uri = "sounds/violin.flac", .directivity = {}, .gain_db = 0, .random_delay_s = 0};
  gltf.emitter_node("violin", violin, {0.9, kStage_m + 1.5, -12.3}, 0);
  return gltf.glb();
}

}  // namespace clamor::assets
