// complete_sample.h: samples until all requested pages are loaded.
#pragma once

#include <span>

#include "runtime/sampling/sampler.h"

namespace clamor::testing {

inline std::span<const SampledSource> complete_sample(Sampler& sampler, const Vec3& place) {
  auto sample = sampler.sample(place);
  while (!sampler.complete()) sample = sampler.sample(place);
  return sample;
}

}  // namespace clamor::testing
