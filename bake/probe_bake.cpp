#include "bake/probe_bake.h"

#include <optional>
#include <utility>
#include <vector>

#include "bake/batch_tracing.h"
#include "bake/closed_state.h"
#include "bake/journal/journal_set.h"
#include "bake/journal/run_key.h"
#include "bake/probe_tracing.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

// The probes of both states of a level are traced with the same setting.
struct ProbeSetting {
  const BakeOptions& options;
  const TraceSettings& trace;
  std::uint64_t photons;
  OpenJournals& journals;
  PortalSetTable& portals;
  const Shard& shard;
};

// Traces the probes in a level, which may be that with closed portals. Adds to the result's counts.
// The sources are missing for a shard and where the bake is stopped.
Result<std::optional<ProbeSources>> trace_probes(const Scene& scene, const Level& level,
                                                 const Level& probes, const ProbeZones& zones,
                                                 const PortalSet& first_portals,
                                                 const ProbeSetting& with, ProbeBake& result) {
  const std::uint32_t sources = with.options.probe_sources;
  ProbePlan plan = plan_probes(scene, probes, zones, sources, with.photons, with.trace);
  plan.trace.first_portals = first_portals;
  const PhotonTracer tracer(scene, probes, plan.trace);
  JournalSet journal_set(with.journals, RunKeys(probes, tracer, scene_hash(level, plan.trace)));
  ProbeCollector collector(scene, probes, zones, tracer, plan.photons, sources, with.portals);
  BatchTracing::RunSink sink;
  if (with.shard.count == 1)
    sink = [&](const TracedRun& run, std::span<const Deposit> deposits, std::uint64_t order) {
      collector.add(run, deposits, order);
    };
  BatchTracing tracing(tracer, plan.photons, with.options, journal_set, with.shard, nullptr, sink);
  if (const auto traced = tracing.run(); !traced.ok()) return traced.error();
  result.photons += tracing.progress().photons_done;
  result.photons_reused += tracing.progress().photons_reused;
  if (with.shard.count > 1 || with.options.is_stopped()) return std::optional<ProbeSources>();
  return std::optional(collector.take());
}

}  // namespace

Result<ProbeBake> bake_probes(const Scene& scene, const Level& level, const BakeOptions& options,
                              const TraceSettings& trace, std::uint64_t photons,
                              OpenJournals& journals, PortalSetTable& portals, const Shard& shard) {
  ProbeBake result;
  if (options.probes_m.empty()) return result;
  const ProbeZones zones = group_probes(scene, level.portals, options.probes_m);
  const Level probes = level_of_probes(level, options.probes_m, zones);
  TraceSettings of_probes = trace;
  of_probes.images = nullptr;  // those are of the level's emitters
  const ProbeSetting with{options, of_probes, photons, journals, portals, shard};
  auto open = trace_probes(scene, level, probes, zones, trace.first_portals, with, result);
  if (!open.ok()) return open.error();
  std::vector<ProbeSources> states;
  if (*open) states.push_back(std::move(**open));
  if (has_closed_state(level) && !with.options.is_stopped()) {
    const Level closed_one = closed_level(level);
    const Scene closed_scene(closed_one.mesh);
    auto closed = trace_probes(closed_scene, closed_one, probes, zones,
                               PortalSet::of_state(PortalSet::kStateClosed), with, result);
    if (!closed.ok()) return closed.error();
    if (*closed) states.push_back(std::move(**closed));
  }
  if (!with.options.is_stopped()) result.probes = build_probes(probes, zones, std::move(states));
  return result;
}

}  // namespace clamor
