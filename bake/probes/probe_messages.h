// probe_messages.h: warns of hand-placed probes at which no source is heard.
#pragma once

#include <string>
#include <vector>

#include "bake/trace/scene.h"

namespace clamor {

struct Level;

// A sentence without full stop for each of the first few probes that lie in solids, outside a
// closed level or on a surface, and one for all others. The level must have triangles.
std::vector<std::string> probe_warnings(const Scene& scene, const Level& level);

}  // namespace clamor
