// probe_levels.h: rooms with probes, and what tests ask of them.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "bake/probes/air_lattice.h"
#include "bake/probes/probe_placement.h"
#include "bake/trace/scene.h"
#include "common/random.h"
#include "tests/rooms.h"

namespace clamor::testing {

inline Emitter named_emitter(const std::string& name, const Vec3& place_m) {
  Emitter emitter;
  emitter.name = name;
  emitter.position_m = place_m;
  return emitter;
}

// A level of one material with an emitter at the place.
inline Level level_of(Mesh mesh, const Vec3& emitter_m) {
  Level level;
  level.mesh = std::move(mesh);
  level.materials = {uniform_material(0.2f)};
  level.signals = {sine()};
  level.emitters = {named_emitter("source", emitter_m)};
  return level;
}

// Adds a closed box.
inline void add_box(Mesh& mesh, const Vec3& low_m, const Vec3& high_m) {
  const Mesh other = box(high_m - low_m);
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  for (const Vec3f& vertex : other.vertices_m) mesh.vertices_m.push_back(vertex + Vec3f(low_m));
  for (const auto& t : other.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  mesh.materials.insert(mesh.materials.end(), other.triangles.size(), 0);
}

// Two rooms of 6 by 5 m with a wall at x = 6 and a door 0.9 m wide and 2 m high in its middle.
inline Mesh two_rooms_mesh() {
  const Vec3 size_m(12, 2.7, 5);
  Mesh mesh = box(size_m);
  const auto wall = [&](double low_y, double high_y, double low_z, double high_z) {
    add_quad(mesh, {Vec3f(6, low_y, low_z), Vec3f(6, high_y, low_z), Vec3f(6, high_y, high_z),
                    Vec3f(6, low_y, high_z)});
  };
  wall(0, 2.7, 0, 2.05);
  wall(0, 2.7, 2.95, 5);
  wall(2, 2.7, 2.05, 2.95);
  return mesh;
}

inline ProbePlacement placed(const Level& level, const ProbeOptions& options = {}) {
  const Scene scene(level.mesh);
  auto placement = place_probes(scene, level, options);
  EXPECT_TRUE(placement.ok()) << placement.error().message;
  return placement.ok() ? *placement : ProbePlacement{};
}

inline ProbeOptions every(double spacing_m) {
  ProbeOptions options;
  options.placement = ProbeOptions::Placement::kSpacing;
  options.spacing_m = spacing_m;
  return options;
}

inline bool is_inside(const Vec3& place_m, const Vec3& low_m, const Vec3& high_m) {
  return glm::all(glm::greaterThan(place_m, low_m)) && glm::all(glm::lessThan(place_m, high_m));
}

inline std::size_t count_inside(const std::vector<Vec3>& places_m, const Vec3& low_m,
                                const Vec3& high_m) {
  return static_cast<std::size_t>(
      std::count_if(places_m.begin(), places_m.end(),
                    [&](const Vec3& place_m) { return is_inside(place_m, low_m, high_m); }));
}

// Returns whether a probe within the distance is visible from the place.
inline bool sees_a_probe(const Scene& scene, const Vec3& place_m, const std::vector<Vec3>& probes_m,
                         double within_m) {
  return std::any_of(probes_m.begin(), probes_m.end(), [&](const Vec3& probe_m) {
    return length(probe_m - place_m) <= within_m && is_free(scene, place_m, probe_m);
  });
}

}  // namespace clamor::testing
