// probe_copies.h: all secondary sources of probes that a source at a place is heard through.
//
// ProbePool samples from these and from first reflections. Tools that need every source use the
// list.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "formats/bake_file/page_links.h"
#include "formats/bake_file/source.h"
#include "runtime/probes/probe_neighbours.h"
#include "runtime/probes/probe_sources.h"

namespace clamor {

// `sources_of` returns the stored sources of a tree. The copies belong to `emitter`,
// and late ones have a material like late_reflection_material().
std::vector<Source> probe_copies(
    std::span<const ProbeWeight> weights, const StoredProbes& probes,
    const std::function<std::span<const Source>(const StoredTree& tree)>& sources_of,
    const MovingRadiator& radiator, double speed_of_sound_mps, std::uint32_t emitter,
    std::uint16_t late_material);

}  // namespace clamor
