#include "bake/probe_bake.h"

#include "bake/batch_tracing.h"
#include "bake/journal/journal_set.h"
#include "bake/journal/run_key.h"
#include "bake/probe_tracing.h"
#include "formats/level/level.h"

namespace clamor {

Result<ProbeBake> bake_probes(const Scene& scene, const Level& level, const BakeOptions& options,
                              const TraceSettings& trace, std::uint64_t photons,
                              std::span<TraceJournal> journals, bool writes,
                              PortalSetTable& portals, const Shard& shard) {
  ProbeBake result;
  if (options.probes_m.empty()) return result;
  const ProbeZones zones = group_probes(scene, level.portals, options.probes_m);
  const Level probes = level_of_probes(level, options.probes_m, zones);
  ProbePlan plan = plan_probes(scene, probes, zones, options.probe_sources, photons, trace);
  plan.trace.first_portals = {};  // probes are traced with open portals only
  const PhotonTracer tracer(scene, probes, plan.trace);
  JournalSet journal_set(journals, writes, probes, tracer, scene_hash(level, plan.trace));
  ProbeCollector collector(scene, probes, zones, tracer, plan.photons, options.probe_sources,
                           portals);
  BatchTracing::RunSink sink;
  if (shard.count == 1)
    sink = [&](const TracedRun& run, std::span<const Deposit> deposits, std::uint64_t order) {
      collector.add(run, deposits, order);
    };
  BatchTracing tracing(tracer, probes, plan.photons, options, journal_set, shard, nullptr, sink);
  const auto traced = tracing.run();
  if (!traced.ok()) return traced.error();
  result.photons = tracing.progress().photons_done;
  result.photons_reused = tracing.progress().photons_reused;
  const bool is_stopped = options.stop != nullptr && options.stop->load(std::memory_order_relaxed);
  if (shard.count == 1 && !is_stopped) result.probes = collector.take();
  return result;
}

}  // namespace clamor
