// probe_bake.h: the probes' part of a bake, and of a shard of one.
#pragma once

#include <list>

#include "bake/portals/portal_sets.h"
#include "bake/trace_pass.h"
#include "bake/traced_state.h"
#include "common/result.h"
#include "formats/bake_file/bake_contents.h"

namespace clamor {

// Traces options.probes_m, or the shard's part of them, in all states of the level, the first of
// which is the level as it is. The thinning of its emitters does not apply here. The sets of
// portals that paths have passed are added to `portals`. Empty for a shard. Fails when it is
// stopped. Runs on the caller's team.
Result<BakedProbes> bake_probes(const std::list<TracedState>& states, const BakePasses& passes,
                                PortalSetTable& portals);

}  // namespace clamor
