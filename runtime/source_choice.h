// source_choice.h: what an auralizer chooses its voices from, and the sampler that does it.
//
// A file's sources come page by page, those of an input are a list; sources that move join either,
// and what a level's surfaces hide is asked of them where that is wanted.
//
// The sampler thread's, but for what says otherwise.
#pragma once

#include <memory>

#include "runtime/auralizer_input.h"
#include "runtime/auralizer_options.h"
#include "runtime/octree/octree_pool.h"
#include "runtime/octree/page_loader.h"
#include "runtime/sampling/moving_list.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/sampling/sampler.h"
#include "runtime/sampling/strategies.h"
#include "runtime/sight/sight_geometry.h"
#include "runtime/sight/visibility_cache.h"

namespace clamor {

// The strategy that options name, with what it is to be tuned to.
StrategyOptions strategy_of(const AuralizerOptions& options);

// Do surfaces hide anything from it?
bool looks(const AuralizerOptions& options);

class SourceChoice {
 public:
  // From a file, whose pages take what `sounds_bytes` leaves of the memory, or from the input's
  // sources where there is none. All must outlive it; `ceilings` are what signals count for
  // wherever they are played (signal_maps.h). An input's sources become its own.
  SourceChoice(AuralizerInput& input, const BakeFile* file, const SourceField& field,
               const SignalWeights& weights, const SignalWeights& ceilings,
               std::uint64_t sounds_bytes, const AuralizerOptions& options);

  Sampler& sampler() const { return *sampler_; }

  // Those that move, which are a caller's; null where there are none.
  MovingSources* moving() const { return moving_.get(); }

  // After each sample: finds what hides faster from soon on, where that was put off.
  void improve_sight();

  const VisibilityCache* sight() const { return sight_.get(); }  // or null
  const PageLoader* loader() const { return loader_.get(); }     // null without a file

 private:
  void look_for_what_hides(const AuralizerInput& input, const SourceField& field,
                           const AuralizerOptions& options);
  void join_moving(const AuralizerInput& input, const SourceField& field,
                   const SignalWeights& weights, const MovingOptions& options);

  std::unique_ptr<SightGeometry> surfaces_;
  std::unique_ptr<VisibilityCache> sight_;
  std::unique_ptr<PageLoader> loader_;
  std::unique_ptr<SourcePool> pool_;
  std::unique_ptr<MovingSources> moving_;
  std::unique_ptr<MovingList> movers_;
  std::unique_ptr<SourcePool> joined_;  // pool and movers
  std::unique_ptr<Sampler> sampler_;
};

}  // namespace clamor
