// sampled_response.h: what a sample of the sources makes of an impulse (the paper, figure 6).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tools/analysis/energy_response.h"
#include "runtime/sampling/strategies.h"

namespace clamor {

// The arrivals of energy_response.h, of these sources alone, scaled and visible as they are; silent
// ones too.
std::vector<Arrival> arrivals_of(std::span<const SampledSource> sample, const RadiationModel& field,
                                 const std::vector<Emitter>& emitters, const Vec3& listener_m);

// Of one emitter's impulse: its sources are chosen by what they make of a single sample of 1,
// whatever signal it plays. With strategy "all" as energy_response(). "priority" has late sources
// boosted as a player has, and asks what the surfaces hide; the paper's own strategies do not.
std::vector<Arrival> sampled_response(const StrategyOptions& options,
                                      std::span<const Source> sources,
                                      const std::vector<Emitter>& emitters,
                                      std::span<const Material> materials, const Air& air,
                                      const Vec3& listener_m, std::uint32_t emitter,
                                      const LateBoost& late_boost = {},
                                      const OcclusionGeometry* surfaces = nullptr);

}  // namespace clamor
