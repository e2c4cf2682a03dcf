// probe_bake.h: the probes' part of a bake, and of a shard of one.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/bake_options.h"
#include "bake/journal/journal_set.h"
#include "bake/portals/portal_sets.h"
#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "common/result.h"
#include "formats/bake_file/bake_contents.h"

namespace clamor {

struct Level;

struct ProbeBake {
  BakedProbes probes;  // empty for a shard
  std::uint64_t photons = 0, photons_reused = 0;
};

// Traces options.probes_m, or the shard's part of them, in both states of the level if it has two
// (closed_state.h). `trace` and `photons` are those of the level's emitters; their thinning does
// not apply here. The sets of portals that paths have passed are added to `portals`. Returns a
// partial result when options.stop is set. Runs in the calling TBB arena.
Result<ProbeBake> bake_probes(const Scene& scene, const Level& level, const BakeOptions& options,
                              const TraceSettings& trace, std::uint64_t photons,
                              OpenJournals& journals, PortalSetTable& portals,
                              const Shard& shard = {});

}  // namespace clamor
