#include "bake/probe_bake.h"

#include <utility>
#include <vector>

#include "bake/probe_tracing.h"
#include "formats/level/level.h"

namespace clamor {

Result<BakedProbes> bake_probes(const std::list<TracedState>& states, const BakePasses& passes,
                                PortalSetTable& portals) {
  const BakeOptions& options = passes.options;
  if (options.probes_m.empty()) return BakedProbes{};
  const TracedState& open = states.front();
  const ProbeZones zones = group_probes(open.scene, open.level.portals, options.probes_m);
  const Level probes = level_of_probes(open.level, options.probes_m, zones);
  std::vector<ProbeSources> sources;
  for (const TracedState& state : states) {
    ProbePlan plan = plan_probes(state.scene, probes, zones, options.probe_sources,
                                 open.probe_photons(options.settings), open.trace);
    plan.trace.first_portals = state.trace.first_portals;
    const PhotonTracer tracer(state.scene, probes, plan.trace);
    ProbeCollector collector(state.scene, probes, zones, tracer, plan.photons,
                             options.probe_sources, portals);
    const auto collect = [&](const TracedRun& run, std::span<const Deposit> deposits) {
      if (passes.shard.count == 1) collector.add(run, deposits);
    };
    const auto traced =
        trace_pass({"probes", state.level, probes, tracer, plan.photons, nullptr, collect}, passes);
    if (!traced.ok()) return traced.error();
    if (passes.shard.count == 1) sources.push_back(collector.take());
  }
  return build_probes(probes, zones, std::move(sources));
}

}  // namespace clamor
