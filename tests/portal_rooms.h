// portal_rooms.h: two rooms that are joined by a doorway with a portal.
#pragma once

#include <algorithm>
#include <numeric>
#include <tuple>
#include <vector>

#include "bake/bake.h"
#include "formats/level/level.h"
#include "tests/rooms.h"

namespace clamor::testing {

inline constexpr float kPortalWall_m = 6;  // x of the wall between the rooms

// Two rooms of 6 by 5 m, a wall at x = 6 and a door 0.9 m wide and 2 m high. The emitter is in the
// first room.
inline Level portal_rooms(bool has_portal = true) {
  Level level = shoebox({12, 2.7, 5}, uniform_material(0.2f), {2, 1.5, 1.2});
  const auto wall = [&](double low_y, double high_y, double low_z, double high_z) {
    const double x = static_cast<double>(kPortalWall_m);
    add_quad(level.mesh, {Vec3f(x, low_y, low_z), Vec3f(x, high_y, low_z), Vec3f(x, high_y, high_z),
                          Vec3f(x, low_y, high_z)});
  };
  wall(0, 2.7, 0, 2.05);
  wall(0, 2.7, 2.95, 5);
  wall(2, 2.7, 2.05, 2.95);
  if (has_portal) level.portals = {{"Door", {6, 1, 2.5}, {0, 0, 0.45}, {0, 1, 0}}};
  return level;
}

inline BakeContents baked_portal_rooms(bool has_portal = true, std::uint64_t photons = 2000) {
  BakeOptions options;
  options.settings.photons = photons;
  options.threads = 2;
  return *bake(portal_rooms(has_portal), options);
}

// The set of portals that the sound of a source has passed.
inline PortalSet set_of(const BakeContents& contents, const Source& source) {
  if (source.emitter < contents.emitters.size()) return {};
  const auto& pairs = contents.portals.emitters;
  return contents.portals.sets[pairs[source.emitter - contents.emitters.size()].set];
}

inline PortalSet set_with(const std::vector<std::size_t>& portals) {
  PortalSet set;
  for (const std::size_t portal : portals) set.add(portal);
  return set;
}

// Everything but u and polarity, which are hashes of the other values, of the secondary sources
// whose sets `wanted` accepts.
using Physics = std::tuple<float, float, float, float, float, float, float>;
template <class Wanted>
std::vector<Physics> physics_of(const BakeContents& contents, const Wanted& wanted) {
  std::vector<Physics> all;
  for (const Source& source : contents.octree.sources)
    if (!source.is_emitter && wanted(set_of(contents, source)))
      all.emplace_back(source.position_m.x, source.position_m.y, source.position_m.z,
                       source.delay_s,
                       std::accumulate(source.power.begin(), source.power.end(), 0.0f),
                       source.patch_radius_m, source.mirror.x);
  std::sort(all.begin(), all.end());
  return all;
}
inline std::vector<Physics> physics_of(const BakeContents& contents) {
  return physics_of(contents, [](const PortalSet&) { return true; });
}

}  // namespace clamor::testing
