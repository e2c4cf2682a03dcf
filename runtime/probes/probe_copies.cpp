#include "runtime/probes/probe_copies.h"

namespace clamor {

std::vector<Source> probe_copies(
    std::span<const ProbeWeight> weights, const StoredProbes& probes,
    const std::function<std::span<const Source>(const StoredTree& tree)>& sources_of,
    const MovingRadiator& radiator, double speed_of_sound_mps, std::uint32_t emitter,
    std::uint16_t late_material) {
  std::vector<Source> copies;
  const auto add = [&](Source source, float weight) {
    source.emitter = emitter;
    for (float& band : source.power) band *= weight;
    copies.push_back(source);
  };
  for (const ProbeWeight& weight : weights) {
    const StoredProbe& probe = probes.places[weight.probe];
    for (const Source& stored : sources_of(probe.tree))
      add(early_reflection(stored, probe.position_m, radiator, speed_of_sound_mps), weight.weight);
    for (const Source& stored : sources_of(probes.zones[probe.zone]))
      add(late_reflection(stored, radiator, late_material), weight.weight);
  }
  return copies;
}

}  // namespace clamor
