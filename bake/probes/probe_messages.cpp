#include "bake/probes/probe_messages.h"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>

#include "bake/probes/reachable_air.h"
#include "bake/report/audibility.h"
#include "bake/report/audibility_messages.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

constexpr std::size_t kShownProbes = 3;

}  // namespace

std::vector<std::string> probe_warnings(const Scene& scene, const Level& level) {
  if (level.probes_m.empty()) return {};
  const Audibility audibility(scene, level.mesh, level.materials);
  std::vector<Emitter> emitters;
  for (const Vec3& probe_m : level.probes_m) emitters.push_back(emitter_at(probe_m));
  const auto inaudible = audibility.inaudible(emitters);
  const std::size_t shown = std::min(inaudible.size(), kShownProbes);
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < shown; ++i)
    warnings.push_back(probe_in_words(inaudible[i].place, inaudible[i].emitter + 1,
                                      level.probes_m[inaudible[i].emitter], level.origin_m));
  if (inaudible.size() > shown)
    warnings.push_back(fmt::format("{} more probes lie inside solids, outside or on surfaces",
                                   inaudible.size() - shown));
  return warnings;
}

}  // namespace clamor
