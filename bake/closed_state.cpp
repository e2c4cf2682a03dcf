#include "bake/closed_state.h"

#include <algorithm>
#include <utility>

#include "bake/journal/journal_set.h"
#include "bake/journal/run_key.h"
#include "bake/trace/scene.h"
#include "formats/level/level.h"

namespace clamor {

Level closed_level(const Level& level) {
  Level closed = level;
  for (std::size_t p = 0; p < level.portals.size(); ++p) {
    const Portal& portal = level.portals[p];
    if (!portal.is_baked_closed) continue;
    Mesh& mesh = closed.mesh;
    const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
    for (const auto& [u, v] : {std::pair(-1.0, -1.0), {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}})
      mesh.vertices_m.emplace_back(portal.centre_m + portal.half_u_m * u + portal.half_v_m * v);
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
    mesh.materials.insert(mesh.materials.end(), 2, level.portal_materials[p]);
  }
  return closed;
}

bool has_closed_state(const Level& level) {
  return std::any_of(level.portals.begin(), level.portals.end(),
                     [](const Portal& portal) { return portal.is_baked_closed; });
}

Result<BatchTracing::Output> trace_closed_state(const Level& level, const TraceSettings& open,
                                                const BakeOptions& options, OpenJournals& journals,
                                                const Shard& shard, BakeReport& report,
                                                bool thins_on_disk) {
  if (!has_closed_state(level)) return BatchTracing::Output{};
  const Level closed = closed_level(level);
  const Scene scene(closed.mesh);
  TraceSettings trace = open;
  const BakePlan plan = make_bake_plan(scene, closed, options.settings, open);
  trace.deposit_threshold = plan.deposit_threshold;
  trace.decay = plan.decay;
  trace.longest_path_s = plan.longest_path_s;
  trace.fade_s = plan.fade_s;
  trace.first_portals = PortalSet::of_state(PortalSet::kStateClosed);
  const PhotonTracer tracer(scene, closed, trace);
  JournalSet journal_set(journals, RunKeys(closed, tracer, scene_hash(closed, trace)));
  BatchTracing tracing(tracer, plan, options, journal_set, shard);
  tracing.name_stage("closed portals");
  if (thins_on_disk) tracing.thin_on_disk(options.spill);
  auto traced = tracing.run();
  report.photons += tracing.progress().photons_done;
  report.photons_reused += tracing.progress().photons_reused;
  return traced;
}

}  // namespace clamor
