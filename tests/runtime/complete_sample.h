// complete_sample.h: what a sampler chooses once all pages that it asked for are there.
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
