// baked_portals.h: the portals of a bake, and the sets of them that sound has passed.
//
// A secondary source belongs to a set of portals: those that the path of its sound has passed. The
// source of an emitter whose sound passed some refers to a virtual emitter, which stands for the
// pair of the emitter and the set, and is numbered after all emitters. It sounds like its emitter;
// only its power depends on the portals. The source of a probe has the number of its set above the
// first leg (first_leg.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/level/emitter.h"
#include "formats/level/portal.h"

namespace clamor {

inline constexpr std::size_t kMaxPortalSets = 2048;

// The openness of a portal that its movable parts open and close (portal_coupling.h). One without
// parts is open.
inline constexpr float kOpenedByParts = -1;

// A virtual emitter.
struct PortalEmitter {
  std::uint32_t emitter = 0, set = 0;

  bool operator==(const PortalEmitter&) const = default;
};

struct BakedPortals {
  std::vector<Portal> portals;
  std::vector<PortalSet> sets;  // the first one is empty; none without portals
  std::vector<PortalEmitter> emitters;

  bool operator==(const BakedPortals&) const = default;
};

// The emitters that sources refer to: those of the level, then the virtual ones.
std::vector<Emitter> source_emitters(std::span<const Emitter> emitters,
                                     const BakedPortals& portals);

// The share of the power that passes each set: the product of its portals' openness, 0 to 1.
// Portals beyond the end of the list are open.
//
// With O the mean openness of the portals that are baked closed, sets of the open state count O, or
// less if one of these portals that they pass is less open, and sets of the closed state 1 - O.
std::vector<float> openness_by_set(const BakedPortals& portals, std::span<const float> openness);

}  // namespace clamor
