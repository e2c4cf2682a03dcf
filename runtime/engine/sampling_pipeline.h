// sampling_pipeline.h: builds what an auralizer samples from (streamed pages or a list of sources,
// moving sources, occlusion), and the sampler on top.
//
// Threads: the sampler's unless noted.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/memory_budget.h"
#include "runtime/occlusion/level_surfaces.h"
#include "runtime/occlusion/part_scene.h"
#include "runtime/occlusion/portal_parts.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/sampling/part_script.h"

namespace clamor {

class BakeFile;
class MovingParts;
class MovingSourceList;
class MovingSources;
class OcclusionGeometry;
class PageLoader;
class PartImages;
class PreparedSignal;
class ProbeBounds;
class ProbePool;
class RadiationModel;
class Sampler;
class SamplingStrategy;
class SourceList;
class SourcePool;
class VisibilityCache;
struct AuralizerOptions;
struct SamplerStatistics;

// The strategy of the options, or the default one.
const SamplingStrategy& strategy_options_of(const AuralizerOptions& options);

// Returns whether surfaces occlude sources.
bool uses_occlusion(const AuralizerOptions& options);
bool reflects_moving_sources(const BakeFile& file, const AuralizerOptions& options);

class SamplingPipeline {
 public:
  // From a file, whose pages have their share of `memory`, or without one from the input's sources,
  // which are moved out of it. With a field and no moving sources,
  // samples serve more keyframes. `slot_weights` are those
  // of SignalWeights::slots. All references but `memory` must outlive this.
  SamplingPipeline(AuralizerInput& input, const BakeFile* file, const RadiationModel& radiation,
                   std::span<const PreparedSignal> signals, const MemoryBudget& memory,
                   std::shared_ptr<std::vector<LoudnessTrack>> slot_weights,
                   const AuralizerOptions& options, bool has_field);
  ~SamplingPipeline();

  Sampler& sampler() const { return *sampler_; }

  // Sources that the caller moves; null if there are none.
  MovingSources* moving() const { return moving_.get(); }

  // Parts that the caller moves, and which of them are the level's, by their index; null without
  // occlusion, and if there are none and none may be added.
  MovingParts* parts() const { return parts_.get(); }
  std::span<const PartHandle> level_parts() const { return level_parts_; }

  // All of that, for scripts.
  PartScript::Stage stage() const { return {parts_.get(), level_parts_, of_level_, origin_m_}; }

  // Call before each sample: takes over the changes of parts(), and opens and closes their portals.
  void update_parts();
  // Returns whether there are changes that update_parts() has not taken over.
  bool has_new_parts() const { return parts_ != nullptr && !part_scene_.is_up_to_date(*parts_); }

  // Scales the power of the sources of each emitter of the level, and of what has passed each of
  // its portals: 0 to 1, or kOpenedByParts. Emitters beyond the end of a list have their
  // full power, and portals beyond it are opened by their parts.
  void set_emitter_powers(std::vector<float> powers);
  void set_portals(std::vector<float> openness);

  void limit_group(std::uint16_t group, std::size_t max_voices);
  // Sources that played this signal and were removed are heard no more.
  void forget_removed(std::uint32_t signal);

  // Call after each sample: builds the full acceleration structure for rays if that was put off.
  void improve_occlusion();

  const VisibilityCache* occlusion() const { return occlusion_.get(); }  // or null
  PageLoader* loader() const { return loader_.get(); }                   // null without a file
  PageLoader* probe_loader() const { return probe_loader_.get(); }       // null without probes

  // Sets what the last sample took and lacked.
  void count(SamplerStatistics& counted) const;

 private:
  void add_surfaces(AuralizerInput& input, BvhQuality quality);
  void add_occlusion(AuralizerInput& input, const RadiationModel& radiation,
                     const AuralizerOptions& options);
  void add_parts(const AuralizerInput& input);
  void add_moving(AuralizerInput& input, const BakeFile* file, const RadiationModel& radiation,
                  const MemoryBudget& memory, const AuralizerOptions& options);
  void add_probes(AuralizerInput& input, const BakeFile& file, const RadiationModel& radiation,
                  const MemoryBudget& memory, const AuralizerOptions& options);
  void apply_powers();

  SignalWeights weights_;
  const SignalWeights max_weights_;  // over all instances that play a signal (signal_maps.h)
  std::unique_ptr<MovingParts> parts_;
  std::vector<PartHandle> level_parts_;
  std::span<const MovablePart> of_level_;  // the input's
  Vec3 origin_m_{};                        // likewise
  PartScene part_scene_;
  const BakedPortals& portals_;  // the input's,
  const std::size_t first_portal_emitter_;
  PortalParts portal_parts_;
  std::vector<float> emitter_powers_, portal_openness_;  // as set
  std::unique_ptr<OcclusionGeometry> surfaces_;
  std::unique_ptr<VisibilityCache> occlusion_;
  std::unique_ptr<PageLoader> loader_;
  std::unique_ptr<SourcePool> pool_;
  std::unique_ptr<MovingSources> moving_;
  std::unique_ptr<MovingSourceList> moving_list_;
  std::unique_ptr<const ProbeBounds> probe_bounds_;
  std::unique_ptr<PageLoader> probe_loader_;
  std::unique_ptr<ProbePool> probes_;
  std::unique_ptr<SourceList> images_;
  std::unique_ptr<PartImages> part_images_;
  std::unique_ptr<SourcePool> joined_;  // pool_, images_, moving_list_, probes_ and part_images_
  std::unique_ptr<Sampler> sampler_;
};

}  // namespace clamor
