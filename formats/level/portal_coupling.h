// portal_coupling.h: finds the movable parts that open and close portals.
//
// A portal and the door in it are one thing to a game, which moves the door. So a part belongs to
// the portal that has its name (the nearest one, where several do), and one without such a portal
// to those whose rectangle it covers, as it stands at rest or turned about its pivot. A part that
// slides away from its portal at rest needs the name, and so does one that is thicker than 0.5 m.
// Patterns for the names of parts replace both rules.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/level/movable_part.h"
#include "formats/level/portal.h"

namespace clamor {

// Globs for the names of the parts of a portal. Nothing: they are found by name and place.
using PartPatterns = std::optional<std::vector<std::string>>;

struct PortalCoupling {
  std::vector<std::string> found, warnings;  // in words, for the import's report
};

// Sets the parts of each portal; `patterns` are theirs, in their order. Warns of patterns that
// match no part, and of parts that stand closed in a portal that is not theirs.
PortalCoupling couple_portals(std::span<const MovablePart> parts,
                              std::span<const PartPatterns> patterns, std::span<Portal> portals);

}  // namespace clamor
