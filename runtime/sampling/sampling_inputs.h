// sampling_inputs.h: what a priority sampler draws from, shared by its search and its candidates.
//
// Threads: the sampler's alone.
#pragma once

#include <cstddef>
#include <vector>

#include "common/vec.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/reception.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/query/source_pool.h"
#include "runtime/query/work_budget.h"
#include "runtime/streaming/sound_loader.h"

namespace clamor {

struct SamplingInputs {
  const RadiationModel& radiation;
  const SignalWeights weights;
  SourcePool& pool;
  VisibilityCache* occlusion;           // null: no source is occluded
  std::size_t voices;                   // sample size
  WorkBudget budget{};                  // of all queries
  std::vector<float> emitter_powers{};  // Sampler::set_emitter_powers()
  const SoundLoader* sounds = nullptr;  // null: all sounds are in memory

  // The share of its power that a source has left by its emitter and by portals.
  float power_share(const FoundSource& found) const {
    return found.openness * emitter_power(found);
  }
  float emitter_power(const FoundSource& found) const {
    const std::uint32_t emitter = found.source->emitter;
    return emitter < emitter_powers.size() ? emitter_powers[emitter] : 1.0f;
  }

  // Whether some sounds may not be in memory.
  bool may_lack_sounds() const { return sounds != nullptr && !sounds->all_ready(); }

  // Whether every source that may be chosen must have a visibility estimate that is valid here.
  bool is_exact() const { return occlusion != nullptr && occlusion->exact(); }
};

// Where, when and by which receivers a sample is heard.
struct SamplingMoment {
  Vec3 place_m{};
  double time_s = 0;
  Reception reception;
};

}  // namespace clamor
