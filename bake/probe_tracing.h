// probe_tracing.h: traces probes: places where sources of sound may be at run time.
//
// A probe is traced like an omnidirectional emitter of gain 1. Its first reflections are left out:
// the runtime traces those of a moving source itself (runtime/probes/first_reflections.h). Its
// other early deposits become secondary sources of its own, its late ones those of its zone
// (probe_zones.h); both are thinned to fixed numbers, and become octrees. Each source keeps the
// first leg of its path (formats/bake_file/first_leg.h). Journals and shards treat probes as
// emitters. The paths of a probe's photons depend on its place and the scene, but which of their
// deposits are kept depends on the plan for all probes, so where probes are added or moved all may
// be traced again.
//
// Threads: the caller's team. Memory: 110 bytes per kept source.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bake/bake_options.h"
#include "bake/bake_plan.h"
#include "bake/octree/source_thinning.h"
#include "bake/portals/portal_sets.h"
#include "bake/probes/probe_zones.h"
#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "common/reflection.h"
#include "common/vec.h"
#include "formats/bake_file/bake_contents.h"

namespace clamor {

struct Level;

// The level with an emitter at each place, zone after zone, in place of its own. It has no mesh:
// the scene has it.
Level level_of_probes(const Level& level, std::span<const Vec3> places_m, const ProbeZones& zones);

// The photons of each probe, and how they are traced.
struct ProbePlan {
  BakePlan photons;
  TraceSettings trace;
};

// `level` is that of level_of_probes(), `level_photons` are those of the level's own emitters, or
// of a bake of one, and `trace` gives everything but thinning, decay and images. There must be a
// probe.
ProbePlan plan_probes(const Scene& scene, const Level& level, const ProbeZones& zones,
                      std::uint32_t sources_per_probe, std::uint64_t level_photons,
                      TraceSettings trace);

// The sources of probes in one state of the level (traced_state.h).
struct ProbeSources {
  std::vector<std::vector<Source>> places, zones;  // zone after zone, and their late ones
};

// Makes the octrees of all places, in the order of the emitters of `level` (level_of_probes()), and
// of all zones, from the sources of all states. Without a state there are no probes.
BakedProbes build_probes(const Level& level, const ProbeZones& zones,
                         std::vector<ProbeSources> states);

// Receives the runs of all probes in order, and thins their deposits.
class ProbeCollector {
 public:
  // All arguments must outlive the object. The sets of portals that paths have passed are added to
  // `portals`.
  ProbeCollector(const Scene& scene, const Level& level, const ProbeZones& zones,
                 const PhotonTracer& tracer, const BakePlan& plan, std::uint32_t sources_per_probe,
                 PortalSetTable& portals);

  void add(const TracedRun& run, std::span<const Deposit> deposits);

  // The sources of all places, in the order of the level's emitters, and of all zones, with patch
  // radii.
  ProbeSources take();

 private:
  bool is_first_reflection(const Deposit& deposit) const;
  std::uint32_t first_leg(const Deposit& deposit) const;
  // With the portals that their paths have passed, and patch radii.
  std::vector<Source> completed(std::vector<Source> sources, ProbePortalSets& sets) const;
  void begin_place();
  void begin_zone();
  void finish_place();

  const Scene& scene_;
  const Level& level_;
  const ProbeZones& zones_;
  const PhotonTracer& tracer_;
  const BakePlan& plan_;
  const std::uint32_t sources_per_probe_;
  PortalSetTable& portals_;
  const ReflectionLaws laws_;
  ProbeSources finished_;
  std::optional<SourceThinning> early_, late_;  // of the next place and zone
  ProbePortalSets early_sets_, late_sets_;      // of their sources
  std::uint32_t places_in_zone_ = 0;            // finished
  // Scratch memory for a run: by photon, then of its deposits.
  std::vector<Ray> rays_;
  std::vector<SurfaceHit> hits_;
  std::vector<Source> early_sources_, late_sources_;
};

}  // namespace clamor
