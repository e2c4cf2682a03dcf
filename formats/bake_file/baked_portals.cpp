#include "formats/bake_file/baked_portals.h"

#include <algorithm>

namespace clamor {

std::vector<Emitter> source_emitters(std::span<const Emitter> emitters,
                                     const BakedPortals& portals) {
  std::vector<Emitter> all(emitters.begin(), emitters.end());
  all.reserve(emitters.size() + portals.emitters.size());
  for (const PortalEmitter& one : portals.emitters) all.push_back(emitters[one.emitter]);
  return all;
}

std::vector<float> openness_by_set(const BakedPortals& portals, std::span<const float> openness) {
  const auto openness_of = [&](std::size_t portal) {
    return portal < openness.size() ? openness[portal] : 1.0f;
  };
  float sum = 0, count = 0;
  for (std::size_t p = 0; p < portals.portals.size(); ++p)
    if (portals.portals[p].is_baked_closed) {
      sum += openness_of(p);
      ++count;
    }
  const float mean = count > 0 ? sum / count : 1.0f;
  std::vector<float> by_set;
  for (const PortalSet& set : portals.sets) {
    const bool is_open = set.has_state(PortalSet::kStateOpen);
    float product = 1, least = is_open ? mean : 1.0f;
    set.for_each([&](std::size_t portal) {
      if (is_open && portals.portals[portal].is_baked_closed)
        least = std::min(least, openness_of(portal));
      else
        product *= openness_of(portal);
    });
    by_set.push_back(set.has_state(PortalSet::kStateClosed) ? product * (1 - mean)
                                                            : product * least);
  }
  return by_set;
}

}  // namespace clamor
