// closed_state.h: traces a level a second time, with its portals closed.
//
// A closed door changes the decay of the room that it belongs to, which no openness of the portal
// can tell from the sources of the open level. Where portals ask for it, all of them are surfaces
// in a second state of the level, to which the runtime fades (formats/bake_file/baked_portals.h).
#pragma once

#include "bake/bake.h"
#include "bake/bake_options.h"
#include "bake/bake_plan.h"
#include "bake/batch_tracing.h"
#include "bake/journal/journal_set.h"
#include "bake/trace/photon_tracer.h"
#include "common/result.h"

namespace clamor {

struct Level;

// Whether portals of the level are baked closed, too.
bool has_closed_state(const Level& level);
// The level with the rectangles of its portals that are baked closed as surfaces.
Level closed_level(const Level& level);

// Traces the level with closed portals by a plan of its own. `open` are the settings with open
// portals. Adds the photons to the report. Empty without a closed state. `thins_on_disk` needs
// options.spill. Runs in the calling TBB arena. Memory: a copy of the mesh.
Result<BatchTracing::Output> trace_closed_state(const Level& level, const TraceSettings& open,
                                                const BakeOptions& options, OpenJournals& journals,
                                                const Shard& shard, BakeReport& report,
                                                bool thins_on_disk = false);

}  // namespace clamor
