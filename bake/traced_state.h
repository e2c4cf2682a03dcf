// traced_state.h: a state of a level, with the plan by which its photons are traced.
//
// A closed door changes the decay of the room that it belongs to, which no openness of the portal
// can tell from the sources of the open level. Where portals ask for it, all of them are surfaces
// in a second state of the level, to which the runtime fades (formats/bake_file/baked_portals.h).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bake/bake_plan.h"
#include "bake/report/decay_estimate.h"
#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "formats/bake_file/bake_metadata.h"
#include "formats/bake_file/image_source.h"

namespace clamor {

class PathCache;
class ReweighedPhotons;
struct Level;

// Whether portals of the level are baked closed, too.
bool has_closed_state(const Level& level);

class TracedState {
  std::unique_ptr<const Level> closed_;  // the level of a closed state

 public:
  // The level as it is, which must outlive the object. `reweighed`: photons that are not traced
  // again, or null. `kept`: where those of the last bake are, or null.
  TracedState(const Level& as_it_is, const BakeSettings& settings,
              const ReweighedPhotons* reweighed = nullptr, const PathCache* kept = nullptr);
  // The level with closed portals, by a plan of its own. Memory: a copy of the level.
  TracedState(const TracedState& open, const BakeSettings& settings);

  // Uses about 400 000 deposits at most, which costs a few percent of the tracing time, and fewer
  // where nothing is traced.
  DecayEstimate decay_estimate(bool is_reweighed) const;
  std::vector<ImageSource> images() const;
  // The photons that the probes' numbers are bounded by. A level without emitters traces none
  // itself.
  std::uint64_t probe_photons(const BakeSettings& settings) const;

  const Level& level;
  const Scene scene;
  const int early_order;
  TraceSettings trace;
  BakePlan plan;
  const PhotonTracer tracer;

 private:
  // The settings with the level's images, which the plan needs.
  const TraceSettings& with_images();
  // Complete the settings by the plan.
  const TraceSettings& complete(const ReweighedPhotons* reweighed, const PathCache* kept);
  const TraceSettings& complete_closed();
  void take_estimates();
};

}  // namespace clamor
