// sampling_strategy.h: the interface through which an application brings its own sampler.
//
// The library has one strategy, priority sampling (sampler.h). The strategies of the paper, and the
// one that takes all sources, are in tools/strategies.
//
// Threads: immutable, so any.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "runtime/query/work_budget.h"

namespace clamor {

class MovingSourceList;
class RadiationModel;
class Sampler;
class SourceList;
class SourcePool;
class VisibilityCache;
struct SignalWeights;

inline constexpr int kMaxVoices = 1'000'000;  // ten times what a core mixes

// The data that a sampler draws from. Everything must outlive the sampler.
struct SamplerInput {
  const RadiationModel& radiation;
  const SignalWeights& weights;
  SourcePool& pool;            // all sources, including moving ones
  SourceList* list;            // the baked sources; null unless the strategy needs_list()
  VisibilityCache* occlusion;  // null if nothing occludes
  MovingSourceList* moving;    // null if there are none
  std::size_t voices;          // the size of a sample
  SearchBound bound;
};

class SamplingStrategy {
 public:
  virtual ~SamplingStrategy() = default;

  virtual std::string name() const = 0;  // for messages

  // Whether it needs all baked sources in memory as a list. Weights are then mean levels, and
  // nothing is streamed.
  virtual bool needs_list() const { return false; }
  virtual bool takes_moving_sources() const { return true; }
  virtual bool uses_occlusion() const { return true; }

  virtual std::unique_ptr<Sampler> make_sampler(const SamplerInput& input) const = 0;
};

std::shared_ptr<const SamplingStrategy> priority_strategy();

}  // namespace clamor
