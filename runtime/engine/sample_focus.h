// sample_focus.h: applies a SoloSettings to samples of sources, and describes them for displays.
//
// Threads: the sampler's.
#pragma once

#include <span>
#include <vector>

#include "common/listener.h"
#include "runtime/engine/heard_source.h"
#include "runtime/engine/solo_settings.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/sampling/sampler.h"

namespace clamor {

class SampleFocus {
 public:
  // `emitters` are those of the radiation model. Both must outlive this.
  SampleFocus(const RadiationModel& radiation, const std::vector<Emitter>& emitters)
      : radiation_(radiation), emitters_(emitters) {}

  void set(const SoloSettings& focus) { focus_ = focus; }

  // The sample with its factors of focus, valid until the next call; the same one if the focus is
  // neutral. The keyframe maker fades to factors that change.
  std::span<const SampledSource> apply(std::span<const SampledSource> sample,
                                       const Listener& listener);

  // Replaces `heard` by a description of a sample that apply() has not scaled. Its powers are as
  // they are mixed, with the focus, its gains without.
  void describe(std::span<const SampledSource> sample, const Listener& listener,
                std::vector<HeardSource>& heard) const;

 private:
  SoundPart part_of(const SampledSource& chosen, const Listener& listener) const;

  const RadiationModel& radiation_;
  const std::vector<Emitter>& emitters_;
  SoloSettings focus_;
  std::vector<SampledSource> scaled_;
};

}  // namespace clamor
