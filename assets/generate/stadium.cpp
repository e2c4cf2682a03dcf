#include "stadium.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "bowl.h"
#include "seating.h"
#include "stands.h"

namespace clamor::assets {

namespace {

constexpr double kPitchHalfLength_m = 52.5, kPitchHalfWidth_m = 34;
constexpr double kGateHalfWidth_m = 0.8;  // between the boards before a gate of the stands
// Round the bowl from +X to -Z; north is where -Z is.
constexpr std::array kStandNames = {"east stand", "north east", "north stand", "north west",
                                    "west stand", "south west", "south stand", "south east"};

// Half of sqrt(depth f / c): how much a relief of that depth scatters.
Bands scattering_of_relief(double depth_m) {
  Bands scattering;
  for (std::size_t b = 0; b < kBandCount; ++b)
    scattering[b] = static_cast<float>(
        std::clamp(0.5 * std::sqrt(depth_m * kBandCentres_hz[b] / 343), 0.05, 0.99));
  return scattering;
}

struct Materials {
  MaterialIndex grass_light, grass_dark, line, surround, board_red, board_white, goal, bench, fan;
  StandMaterials stands;
};

Materials make_materials(GltfWriter& gltf) {
  // Lawn of 5 cm: the usual textbook values for 125 to 4000 Hz, continued at both ends.
  const Bands lawn = {0.06f, 0.11f, 0.26f, 0.60f, 0.69f, 0.92f, 0.99f, 0.99f};
  const Bands lawn_relief = scattering_of_relief(0.03);
  // Trapezoidal steel sheet with insulation above: a panel absorber at low frequencies. Estimated.
  const Bands steel_sheet = {0.25f, 0.25f, 0.20f, 0.15f, 0.12f, 0.10f, 0.08f, 0.08f};
  const Bands steel = {0.05f, 0.05f, 0.05f, 0.05f, 0.05f, 0.05f, 0.05f, 0.05f};
  Materials m{};
  m.grass_light = gltf.material("grass_light", {0.10, 0.32, 0.06}, lawn, lawn_relief);
  m.grass_dark = gltf.material("grass_dark", {0.07, 0.24, 0.05}, lawn, lawn_relief);
  m.line = gltf.material("grass_line", {0.85, 0.85, 0.85}, lawn, lawn_relief);
  m.surround = gltf.material("surround", {0.12, 0.20, 0.14}, "carpet_thin");
  m.board_red = gltf.material("board_red", {0.60, 0.05, 0.05, 0.5}, "plywood");
  m.board_white = gltf.material("board_white", {0.80, 0.80, 0.80, 0.5}, "plywood");
  m.goal = gltf.material("goal", {0.9, 0.9, 0.9, 0.4, 0.2}, steel, scattering_of_relief(0.1));
  m.bench = gltf.material("bench_shelter", {0.6, 0.7, 0.8, 0.2}, "glass");
  m.stands.seats = gltf.material("terrace_seats", {0.10, 0.16, 0.35}, "seats_wood");
  m.stands.stairs = gltf.material("terrace_stairs", {0.62, 0.60, 0.45}, "concrete");
  m.stands.wall = gltf.material("terrace_concrete", {0.45, 0.45, 0.44}, "concrete");
  m.stands.floor = gltf.material("concourse_floor", {0.35, 0.35, 0.35}, "concrete_smooth");
  m.stands.roof = gltf.material("roof_steel_sheet", {0.70, 0.72, 0.75, 0.4, 0.6}, steel_sheet,
                                scattering_of_relief(0.1));
  m.stands.beams =
      gltf.material("roof_beams", {0.8, 0.8, 0.8, 0.4, 0.6}, steel, scattering_of_relief(0.4));
  m.fan = gltf.material("fan", {0.55, 0.20, 0.18}, "audience");
  return m;
}

void flat(MeshBuilder& mesh, MaterialIndex material, double x0, double z0, double x1, double z1,
          double y) {
  mesh.quad(material, {x0, y, z1}, {x1, y, z1}, {x1, y, z0}, {x0, y, z0});
}

void add_lines(MeshBuilder& mesh, MaterialIndex material) {
  const double x = kPitchHalfLength_m, z = kPitchHalfWidth_m, w = 0.12, y = 0.01;
  const auto along_x = [&](double x0, double x1, double at_z) {
    flat(mesh, material, x0, at_z - w / 2, x1, at_z + w / 2, y);
  };
  const auto along_z = [&](double z0, double z1, double at_x) {
    flat(mesh, material, at_x - w / 2, z0, at_x + w / 2, z1, y);
  };
  for (const double side : {-1.0, 1.0}) {
    along_x(-x, x, side * (z - w / 2));
    along_z(-z + w, z - w, side * (x - w / 2));
    for (const auto& [half_width, depth] : {std::pair{20.16, 16.5}, std::pair{9.16, 5.5}}) {
      along_z(-half_width, half_width, side * (x - depth));
      for (const double edge : {-half_width, half_width})
        along_x(std::min(side * (x - w), side * (x - depth)),
                std::max(side * (x - w), side * (x - depth)), edge);
    }
  }
  along_z(-z + w, z - w, 0);
  constexpr int kParts = 36;
  const auto on_circle = [&](int part, double radius) {
    const double angle = 2 * 3.14159265358979 * part / kParts;
    return Vec3(radius * std::cos(angle), y, -radius * std::sin(angle));
  };
  for (int i = 0; i < kParts; ++i)
    mesh.quad(material, on_circle(i, 9.15 - w), on_circle(i, 9.15), on_circle(i + 1, 9.15),
              on_circle(i + 1, 9.15 - w));
}

MeshBuilder make_pitch(const Bowl& bowl, const Materials& m) {
  MeshBuilder mesh;
  constexpr int kStripes = 18;
  const double x = kPitchHalfLength_m, z = kPitchHalfWidth_m, width = 2 * x / kStripes;
  for (int i = 0; i < kStripes; ++i)
    flat(mesh, i % 2 ? m.grass_dark : m.grass_light, -x + i * width, -z, -x + (i + 1) * width, z,
         0);
  add_lines(mesh, m.line);

  // From the pitch to the stands, station by station.
  const auto on_edge = [&](const Vec3& p) {
    return Vec3(std::clamp(p.x, -x, x), 0, std::clamp(p.z, -z, z));
  };
  for (std::size_t s = 0; s < bowl.station_count(); ++s) {
    const double at = static_cast<double>(s);
    const Vec3 a = bowl.at(at, 0, 0), b = bowl.at(at + 1, 0, 0);
    mesh.quad(m.surround, on_edge(a), a, b, on_edge(b));
  }
  return mesh;
}

// Boards along all four sides, in panels, open before the gates; goals; a shelter for each team's
// bench.
MeshBuilder make_furniture(const Materials& m) {
  MeshBuilder mesh;
  const auto open = MeshBuilder::Bottom::kOpen;
  const double x = kPitchHalfLength_m + 4.5, z = kPitchHalfWidth_m + 4;
  constexpr int kLongPanels = 18, kShortPanels = 10;
  constexpr double kBoardHeight_m = 0.95, kBoardThickness_m = 0.12;
  for (const double side : {-1.0, 1.0}) {
    for (int i = 0; i < kLongPanels; ++i) {
      const double width = 2 * (x - 1.5) / kLongPanels;
      double from = -(x - 1.5) + i * width, to = from + width;
      if (2 * i == kLongPanels) from += kGateHalfWidth_m;
      if (2 * i + 2 == kLongPanels) to -= kGateHalfWidth_m;
      mesh.box(i % 2 ? m.board_white : m.board_red, {from, 0, side * z - kBoardThickness_m / 2},
               {to, kBoardHeight_m, side * z + kBoardThickness_m / 2}, open);
    }
    for (int i = 0; i < kShortPanels; ++i) {
      const double width = 2 * (z - 1.5) / kShortPanels, from = -(z - 1.5) + i * width;
      mesh.box(i % 2 ? m.board_red : m.board_white, {side * x - kBoardThickness_m / 2, 0, from},
               {side * x + kBoardThickness_m / 2, kBoardHeight_m, from + width}, open);
    }
    const double goal = side * (kPitchHalfLength_m + 0.06);
    for (const double post : {-3.72, 3.72})
      mesh.box(m.goal, {goal - 0.06, 0, post - 0.06}, {goal + 0.06, 2.44, post + 0.06}, open);
    mesh.box(m.goal, {goal - 0.06, 2.44, -3.78}, {goal + 0.06, 2.56, 3.78});

    const double left = side * 14 - 4, right = side * 14 + 4, back = 40.2, front = 38.8;
    mesh.box(m.bench, {left, 0, back}, {right, 2, back + 0.08}, open);
    mesh.box(m.bench, {left, 2, front}, {right, 2.08, back + 0.08});
    for (const double end : {left, right - 0.08})
      mesh.box(m.bench, {end, 0, front}, {end + 0.08, 2, back}, open);
  }
  return mesh;
}

constexpr double kMouth_m = 1.5;  // above the feet of a fan of scale 1

// A standing fan in 12 triangles: a coat from the feet to the shoulders, a point for the head. The
// origin is the mouth, 6 cm in front of the face, looking along -Z.
MeshBuilder make_fan(MaterialIndex material) {
  const double axis = 0.13;  // of the body, behind the mouth
  const auto ring = [&](double half_width, double half_depth, double up_m) {
    return std::array{
        Vec3(-half_width, up_m, axis + half_depth), Vec3(half_width, up_m, axis + half_depth),
        Vec3(half_width, up_m, axis - half_depth), Vec3(-half_width, up_m, axis - half_depth)};
  };
  const auto feet = ring(0.16, 0.10, -kMouth_m), shoulders = ring(0.23, 0.13, -0.22);
  const Vec3 head(0, 0.22, axis);
  MeshBuilder mesh;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t j = (i + 1) % 4;
    mesh.quad(material, feet[i], feet[j], shoulders[j], shoulders[i]);
    mesh.triangle(material, shoulders[i], shoulders[j], head);
  }
  return mesh;
}

// Fans stand in a block, a block in a stand, a stand in the crowd.
void add_crowd(const Bowl& bowl, int fan, std::span<const CrowdSound> sounds,
               const StartTimes& starts, GltfWriter& gltf) {
  const Seating seating = make_seating(bowl, sounds, starts, kFanCount, kMouth_m);
  std::vector<int> emitters;
  for (const CrowdSound& sound : sounds)
    emitters.push_back(
        gltf.emitter("fans_" + sound.name, {.sound_uri = "sounds/" + sound.name + ".flac",
                                            .directivity = sound.directivity,
                                            .gain_db = sound.gain_db}));
  std::vector<std::vector<InstanceList>> places;
  for (const BlockKind& kind : seating.kinds) {
    places.emplace_back();
    for (const FanGroup& group : kind.groups) places.back().push_back(gltf.instances(group.fans));
  }

  const int crowd = gltf.group("crowd", {}, Vec3(0), 0);
  std::vector<int> stands;
  for (std::size_t i = 0; i < kStandNames.size(); ++i)
    stands.push_back(gltf.group(kStandNames[i], crowd, Vec3(0), 0));
  for (const Block& block : seating.blocks) {
    const int node = gltf.group(block.name, stands[block.stand], block.corner_m, block.yaw_rad);
    const BlockKind& kind = seating.kinds[block.kind];
    for (std::size_t i = 0; i < kind.groups.size(); ++i) {
      const std::size_t sound = block.sounds[kind.groups[i].sound];
      gltf.instanced_node("fans_" + sounds[sound].name, node, fan, places[block.kind][i],
                          emitters[sound], block.delay_s);
    }
  }
}

}  // namespace

std::string make_stadium(std::span<const CrowdSound> sounds, const StartTimes& starts) {
  GltfWriter gltf("stadium");
  const Materials materials = make_materials(gltf);
  const Bowl bowl;
  gltf.node("pitch", gltf.mesh("pitch", make_pitch(bowl, materials)));
  gltf.node("boards_goals_benches", gltf.mesh("boards_goals_benches", make_furniture(materials)));
  gltf.node("lower_tier", gltf.mesh("lower_tier", make_lower_tier(bowl, materials.stands)));
  gltf.node("upper_tier", gltf.mesh("upper_tier", make_upper_tier(bowl, materials.stands)));
  gltf.node("concourse", gltf.mesh("concourse", make_concourse(bowl, materials.stands)));
  gltf.node("roof", gltf.mesh("roof", make_roof(bowl, materials.stands)));

  const int fan = gltf.mesh("fan", make_fan(materials.fan));
  add_crowd(bowl, fan, sounds, starts, gltf);
  return gltf.glb();
}

}  // namespace clamor::assets
