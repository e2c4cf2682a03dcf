// probe_zones.h: groups of probes that share their late reflections.
//
// After some reflections a sound has forgotten where in the room it came from. So probes that see
// each other and much the same surfaces, and lie within two mean free paths, share one tree of late
// reflections, with the photons of all of them: the late decay, which few photons of a single probe
// would leave noisy, is then as exact as that of an emitter with many, and is stored once. A probe
// in a doorway, which sends half of its sound into either room, is a zone of its own. No zone
// reaches across a portal: a closed door would not keep the photons of the far side's probes from a
// source.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake/trace/scene.h"
#include "common/vec.h"
#include "formats/level/portal.h"

namespace clamor {

struct ProbeZones {
  std::vector<std::uint32_t> order;  // places, zone after zone
  std::vector<std::uint32_t> sizes;  // places per zone
  // The path length from which reflections are late: that of the middle one of the zones.
  double late_from_m = 0;
};

// The result depends on the scene, the portals and the places alone.
ProbeZones group_probes(const Scene& scene, std::span<const Portal> portals,
                        std::span<const Vec3> places_m);

}  // namespace clamor
