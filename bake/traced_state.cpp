#include "bake/traced_state.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "bake/early/image_search.h"
#include "bake/path_cache.h"
#include "bake/report/decay_estimate.h"
#include "bake/reweighed_photons.h"
#include "bake/trace/image_index.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

// The level with the rectangles of its portals that are baked closed as surfaces.
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

}  // namespace

bool has_closed_state(const Level& level) {
  return std::any_of(level.portals.begin(), level.portals.end(),
                     [](const Portal& portal) { return portal.is_baked_closed; });
}

TracedState::TracedState(const Level& as_it_is, const BakeSettings& settings,
                         const ReweighedPhotons* reweighed, const PathCache* kept)
    : level(as_it_is),
      scene(level.mesh, reweighed != nullptr ? Scene::Build::kQuick : Scene::Build::kThorough),
      early_order(settings.early_order < 0 ? image_order_for(level.emitters.size())
                                           : std::min(settings.early_order, kMaxImageOrder)),
      trace(trace_settings(settings)),
      plan(reweighed != nullptr ? reweighed->plan()
                                : make_bake_plan(scene, level, settings, with_images())),
      tracer(scene, level, complete(reweighed, kept)) {
  if (reweighed != nullptr && settings.sources > 0) plan.sources = settings.sources;
}

TracedState::TracedState(const TracedState& open, const BakeSettings& settings)
    : closed_(std::make_unique<const Level>(closed_level(open.level))),
      level(*closed_),
      scene(level.mesh),
      early_order(open.early_order),
      trace(open.trace),
      plan(make_bake_plan(scene, level, settings, open.trace)),
      tracer(scene, level, complete_closed()) {}

void TracedState::take_estimates() {
  trace.deposit_threshold = plan.deposit_threshold;
  trace.decay = plan.decay;
  trace.longest_path_s = plan.longest_path_s;
  trace.fade_s = plan.fade_s;
}

const TraceSettings& TracedState::with_images() {
  if (auto images = find_images(scene, level, early_order); !images.empty())
    trace.images = std::make_shared<const ImageIndex>(images);
  return trace;
}

const TraceSettings& TracedState::complete(const ReweighedPhotons* reweighed,
                                           const PathCache* kept) {
  if (kept != nullptr) keep_estimates(plan, kept->plan());
  take_estimates();
  if (reweighed != nullptr) trace.images = reweighed->images();
  if (has_closed_state(level)) trace.first_portals = PortalSet::of_state(PortalSet::kStateOpen);
  return trace;
}

const TraceSettings& TracedState::complete_closed() {
  take_estimates();
  trace.first_portals = PortalSet::of_state(PortalSet::kStateClosed);
  return trace;
}

DecayEstimate TracedState::decay_estimate(bool is_reweighed) const {
  const double deposits = is_reweighed ? 30'000 : 400'000;
  return {scene, level, trace, plan.photons, static_cast<std::uint64_t>(plan.deposits / deposits)};
}

std::vector<ImageSource> TracedState::images() const {
  if (trace.images == nullptr) return {};
  return {trace.images->images().begin(), trace.images->images().end()};
}

std::uint64_t TracedState::probe_photons(const BakeSettings& settings) const {
  return plan.photons.empty() && settings.photons == 0 ? ~std::uint64_t{0} : plan.wanted_photons;
}

}  // namespace clamor
