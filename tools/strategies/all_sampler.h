// all_sampler.h: samples every source: the reference for all strategies.
#pragma once

#include <memory>

#include "runtime/sampling/sampler.h"

namespace clamor {

// Everything must outlive the sampler. Without `occlusion` nothing is occluded, without `moving`
// nothing moves.
std::unique_ptr<Sampler> make_all_sampler(const RadiationModel& radiation, const SourceList& list,
                                          VisibilityCache* occlusion = nullptr,
                                          MovingSourceList* moving = nullptr);

}  // namespace clamor
