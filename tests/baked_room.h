// baked_room.h: small baked rooms in memory.
#pragma once

#include <map>

#include "bake/bake.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "tests/rooms.h"

namespace clamor::testing {

// A reflecting shoebox with three emitters that play two sines and a click.
inline BakeContents baked_contents(std::uint64_t photons, std::vector<Portal> portals = {}) {
  Level level = shoebox({6, 8, 3}, uniform_material(0.3f, 0.5f, 20), {2, 3, 1.2});
  level.signals = {sine(440), sine(997), {"click", {1.0f, 0.5f, -0.25f}, false}};
  for (std::uint32_t i = 1; i < 3; ++i) {
    level.emitters.push_back(level.emitters[0]);
    level.emitters[i].position_m = {1.0 + 2 * i, 6.5 - i, 1.5};
    level.emitters[i].signal = i;
    level.emitters[i].delay_s = 0.1 * i;
    level.emitters[i].directivity = same_in_all_bands(2);
  }
  level.portals = std::move(portals);
  BakeOptions options;
  options.settings.photons = photons;
  return *bake(level, options);
}

// Returns the baked room as input of an Auralizer. It is baked at its first use.
inline AuralizerInput baked_room(std::uint64_t photons = 300) {
  static std::map<std::uint64_t, BakeContents> rooms;
  auto room = rooms.find(photons);
  if (room == rooms.end()) room = rooms.emplace(photons, baked_contents(photons)).first;
  const BakeContents& contents = room->second;
  return {contents.octree.sources, contents.emitters, contents.signals, contents.materials,
          contents.settings.air};
}

}  // namespace clamor::testing
