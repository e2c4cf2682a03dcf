// sampling_pipeline.h: what an auralizer chooses its voices from, and the sampler that does it.
//
// A file's sources come page by page, those of an input are a list; sources that move join either,
// and what a level's surfaces hide is asked of them where that is wanted.
//
// The sampler thread's, but for what says otherwise.
#pragma once

#include <memory>

#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/query/octree_pool.h"
#include "runtime/sampling/moving_source_list.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/sampling/sampler.h"
#include "runtime/sampling/strategies.h"
#include "runtime/streaming/page_loader.h"

namespace clamor {

// The strategy that options name, with what it is to be tuned to.
StrategyOptions strategy_options_of(const AuralizerOptions& options);

// Do surfaces hide anything from it?
bool looks(const AuralizerOptions& options);

class SamplingPipeline {
 public:
  // From a file, whose pages take what `sounds_bytes` leaves of the memory, or from the input's
  // sources where there is none. All must outlive it; `ceilings` are what signals count for
  // wherever they are played (signal_maps.h). An input's sources become its own.
  SamplingPipeline(AuralizerInput& input, const BakeFile* file, const RadiationModel& field,
                   const SignalWeights& weights, const SignalWeights& ceilings,
                   std::uint64_t sounds_bytes, const AuralizerOptions& options);

  Sampler& sampler() const { return *sampler_; }

  // Those that move, which are a caller's; null where there are none.
  MovingSources* moving() const { return moving_.get(); }

  // After each sample: finds what hides faster from soon on, where that was put off.
  void improve_occlusion();

  const VisibilityCache* occlusion() const { return occlusion_.get(); }  // or null
  const PageLoader* loader() const { return loader_.get(); }             // null without a file

 private:
  void add_occlusion(const AuralizerInput& input, const RadiationModel& field,
                     const AuralizerOptions& options);
  void join_moving(const AuralizerInput& input, const RadiationModel& field,
                   const SignalWeights& weights, const MovingOptions& options);

  std::unique_ptr<OcclusionGeometry> surfaces_;
  std::unique_ptr<VisibilityCache> occlusion_;
  std::unique_ptr<PageLoader> loader_;
  std::unique_ptr<SourcePool> pool_;
  std::unique_ptr<MovingSources> moving_;
  std::unique_ptr<MovingSourceList> movers_;
  std::unique_ptr<SourcePool> joined_;  // pool and movers
  std::unique_ptr<Sampler> sampler_;
};

}  // namespace clamor
