#include "formats/gltf/gltf_probes.h"

#include <string>

#include "formats/gltf/gltf_marks.h"
#include "formats/level/emitter_spec.h"

namespace clamor {

Result<std::vector<Vec3>> read_scene_probes(const GltfScene& scene,
                                            const std::vector<PlacedNode>& placements) {
  std::vector<Vec3> probes_m;
  for (std::size_t p = 0; p < placements.size();) {
    // All instances of a node are adjacent and share what is read from it.
    const auto index = static_cast<std::size_t>(placements[p].node);
    const auto marks = read_marks(scene, index);
    if (!marks.ok()) return marks.error();
    for (; p < placements.size() && placements[p].node == static_cast<int>(index); ++p) {
      if (!marks->probe) continue;
      const Vec3 place_m(placements[p].world[3]);
      if (!is_finite(place_m) || length(place_m) > kMaxEmitterCoordinate_m)
        return Error(
            node_in_words(scene, index) +
            ": the probe is not within 1000 km of the level's middle; repair the transforms.");
      probes_m.push_back(place_m);
    }
  }
  return probes_m;
}

}  // namespace clamor
