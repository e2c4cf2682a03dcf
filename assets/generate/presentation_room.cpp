#include "presentation_room.h"

#include <cmath>
#include <initializer_list>
#include <numbers>

#include "dice.h"
#include "furniture.h"
#include "gltf_writer.h"
#include "room_shell.h"

namespace clamor::assets {

namespace {

constexpr double kPodium_m = 0.2;

// The room's planes: walls, window and door edges, panelling, ceiling field, lights.
const ShellGrid& grid() {
  static const ShellGrid planes{
      {-4.5, -3.6, -2.7, -2.1, -1.5, 1.5, 2.1, 2.7, 3.6, 4.5},
      {0, 0.9, 2.1, 2.7, 3.6},
      {-6, -5.4, -4.6, -4.5, -2.9, -2, -0.3, 0.6, 2.3, 3.2, 3.8, 4.8, 4.9, 5.4, 6}};
  return planes;
}

struct Range {
  double from_m, to_m;
  bool holds(double value_m) const { return from_m < value_m && value_m < to_m; }
};
constexpr Range kWindows[] = {{-4.6, -2.9}, {-2, -0.3}, {0.6, 2.3}, {3.2, 4.9}};  // along z
constexpr Range kWindowHeight{0.9, 2.7};
constexpr Range kDoors[] = {{-5.4, -4.5}, {3.8, 4.8}};
constexpr double kRoomDoorHeight_m = 2.1;

template <class Ranges>
bool any_holds(const Ranges& ranges, double value_m) {
  for (const Range& range : ranges)
    if (range.holds(value_m)) return true;
  return false;
}

struct ShellMaterials {
  MaterialIndex floor, plaster, panelling, glass, door, tiles, frame, light;
};

Cell wall_at(const ShellMaterials& m, Side side, const Vec3& p) {
  switch (side) {
    case Side::kFloor:
      return {m.floor};
    case Side::kCeiling: {
      const bool in_field = std::abs(p.x) < 2.7 && std::abs(p.z) < 5.4;
      const bool in_light_row = Range{1.5, 2.1}.holds(std::abs(p.x));
      if (in_field && in_light_row && any_holds(kWindows, p.z)) return {m.light};
      // Hard above the podium, so that the back hears; tiles behind.
      return {in_field && p.z > -2.9 ? m.tiles : m.frame};
    }
    case Side::kRight:
      if (kWindowHeight.holds(p.y) && any_holds(kWindows, p.z)) return {m.glass, 0.18};
      return {m.plaster};
    case Side::kLeft:
      if (p.y < kRoomDoorHeight_m && any_holds(kDoors, p.z)) return {m.door, 0.08};
      return {p.y < 0.9 ? m.panelling : m.plaster};
    case Side::kFront:
      return {p.y < 0.9 ? m.panelling : m.plaster};
    case Side::kBack:
      return {p.y < 2.7 && std::abs(p.x) < 3.6 ? m.panelling : m.plaster};
  }
  return {m.plaster};
}

ShellMaterials make_shell_materials(GltfWriter& gltf) {
  ShellMaterials m{};
  m.floor = gltf.material("parquet", {0.42, 0.25, 0.13, 0.5}, "wood_floor");
  m.plaster = gltf.material("wall_plaster", {0.86, 0.84, 0.78}, "plaster");
  m.panelling = gltf.material("wall_panelling", {0.40, 0.22, 0.10, 0.6}, "wood");
  m.glass = gltf.material("window_glass", {0.75, 0.85, 0.90, 0.05, 0, 0.35}, "glass_double");
  m.door = gltf.material("door_leaf", {0.50, 0.30, 0.15, 0.6}, "door");
  m.tiles = gltf.material("ceiling_tiles", {0.90, 0.90, 0.88}, "ceiling_tile");
  m.frame = gltf.material("ceiling_frame", {0.92, 0.92, 0.92}, "plasterboard");
  m.light = gltf.material("ceiling_lights", {1, 1, 0.95, 0.3}, "glass");
  return m;
}

FurnitureMaterials make_furniture_materials(GltfWriter& gltf) {
  // Estimated: sheet metal, and a taut film in front of air.
  const Bands hard = {0.03f, 0.03f, 0.03f, 0.03f, 0.04f, 0.05f, 0.05f, 0.05f};
  const Bands film = {0.15f, 0.20f, 0.18f, 0.12f, 0.10f, 0.10f, 0.10f, 0.10f};
  const Bands smooth = same_in_all_bands(0.05f);
  FurnitureMaterials m{};
  m.upholstery = gltf.material("chair_upholstery", {0.35, 0.06, 0.08}, "seats_upholstered");
  m.wood = gltf.material("furniture_wood", {0.50, 0.33, 0.18, 0.6}, "wood");
  m.lacquer = gltf.material("piano_lacquer", {0.02, 0.02, 0.02, 0.1}, "wood_floor");
  m.metal = gltf.material("metal", {0.55, 0.55, 0.58, 0.4, 0.9}, hard, smooth);
  m.screen = gltf.material("projector_screen", {0.95, 0.95, 0.95}, film, smooth);
  m.curtain = gltf.material("curtains", {0.20, 0.28, 0.42}, "curtain");
  m.person = gltf.material("cloth_and_books", {0.12, 0.12, 0.16}, "audience");
  m.stage = gltf.material("podium", {0.30, 0.18, 0.09, 0.5}, "wood_floor");
  return m;
}

// Objects modelled in place: the podium, the screen, the projector, radiators.
MeshBuilder make_fixtures(const FurnitureMaterials& m) {
  MeshBuilder mesh;
  mesh.box(m.stage, {-3.4, 0, -5.98}, {3.4, kPodium_m, -3.2}, MeshBuilder::Bottom::kOpen);
  mesh.box(m.stage, {-0.8, 0, -3.2}, {0.8, kPodium_m / 2, -2.9}, MeshBuilder::Bottom::kOpen);
  mesh.box(m.screen, {-1.5, 1.5, -5.92}, {1.5, 3.3, -5.90});
  mesh.box(m.metal, {-1.55, 3.3, -5.96}, {1.55, 3.4, -5.86});
  mesh.box(m.metal, {-0.02, 3.2, -1.02}, {0.02, 3.6, -0.98}, MeshBuilder::Bottom::kOpen);
  mesh.box(m.metal, {-0.2, 3.02, -1.18}, {0.2, 3.2, -0.84});
  for (const Range& window : kWindows)
    mesh.box(m.metal, {4.36, 0.15, window.from_m + 0.2}, {4.48, 0.75, window.to_m - 0.2});
  return mesh;
}

void place_chairs(GltfWriter& gltf, const FurnitureMaterials& m) {
  Dice dice(40);
  const int chair = gltf.mesh("chair", make_chair(m));
  for (int row = 0; row < 5; ++row) {
    for (int seat = 0; seat < 8; ++seat) {
      const double from_aisle_m = 0.9 + 0.62 * (seat % 4);
      const Vec3 place((seat < 4 ? -1 : 1) * from_aisle_m, 0, -1.3 + 1.1 * row);
      const double aside_m = dice.between(-0.03, 0.03), back_m = dice.between(-0.05, 0.05);
      gltf.node("chair_" + std::to_string(row + 1) + "_" + std::to_string(seat + 1), chair,
                place + Vec3(aside_m, 0, back_m), dice.between(-0.08, 0.08));
    }
  }
}

void place_furniture(GltfWriter& gltf, const FurnitureMaterials& m) {
  gltf.node("fixtures", gltf.mesh("fixtures", make_fixtures(m)));
  place_chairs(gltf, m);
  gltf.node("piano", gltf.mesh("piano", make_piano(m)), {1.3, kPodium_m, -4.9});
  gltf.node("lectern", gltf.mesh("lectern", make_lectern(m)), {-2.6, kPodium_m, -4.0},
            std::numbers::pi);
  gltf.node("music_stand", gltf.mesh("music_stand", make_music_stand(m)), {-0.45, kPodium_m, -3.75},
            0.5);
  gltf.node("table", gltf.mesh("table", make_table(m, 0.8, 1.8)), {-4.0, 0, 0.6});
  const int shelf = gltf.mesh("shelf", make_shelf(m));
  gltf.node("shelf_1", shelf, {-4.48, 0, -2.4}, -std::numbers::pi / 2);
  gltf.node("shelf_2", shelf, {-4.48, 0, 2.6}, -std::numbers::pi / 2);
  const int drape = gltf.mesh("drape", make_drape(m, 0.54, 2.75));
  for (const Range& window : kWindows) {
    gltf.node("drape", drape, {4.42, 0.1, window.from_m - 0.36});
    gltf.node("drape", drape, {4.42, 0.1, window.to_m - 0.18});
  }
}

}  // namespace

std::string make_presentation_room() {
  GltfWriter gltf("violin_room");
  const ShellMaterials shell = make_shell_materials(gltf);
  const FurnitureMaterials furniture = make_furniture_materials(gltf);
  const MeshBuilder walls = make_shell(grid(), shell.plaster, [&](Side side, const Vec3& middle_m) {
    return wall_at(shell, side, middle_m);
  });
  gltf.node("room", gltf.mesh("room", walls));
  place_furniture(gltf, furniture);

  // The violinist faces the audience (+Z). The violin is 1.5 m above the podium, just in front.
  gltf.node("violinist", gltf.mesh("violinist", make_violinist(furniture)), {0, kPodium_m, -4.4},
            std::numbers::pi);
  const EmitterNode violin{
      .sound_uri = "sounds/violin.flac",
      // Nearly omnidirectional on the G string, a beam of half a sphere at 8 kHz.
      .directivity = {0, 0, 0.1f, 0.25f, 0.6f, 1.1f, 1.8f, 2.6f},
      .gain_db = 0,
      .random_delay_s = 0};
  gltf.emitter_node("violin", violin, {0.15, kPodium_m + 1.5, -4.05}, std::numbers::pi);
  return gltf.glb();
}

}  // namespace clamor::assets
