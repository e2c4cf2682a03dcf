// sampled_response.h: the impulse response of a sample of the sources (the paper, figure 6).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/propagation/radiation_model.h"
#include "runtime/response/energy_response.h"
#include "runtime/sampling/sampler.h"
#include "tools/strategies/strategies.h"

namespace clamor {

// Arrivals as in energy_response.h, of these sources only, scaled and occluded as given, including
// silent ones.
std::vector<Arrival> arrivals_of(std::span<const SampledSource> sample,
                                 const RadiationModel& radiation,
                                 const std::vector<Emitter>& emitters, const Vec3& listener_m);

// Response of one emitter. Sources are sampled by their contribution to a single sample of 1,
// whatever the emitter's signal. Strategy "all" equals energy_response(). "priority" boosts late
// sources and handles occlusion as a player does; the paper's own strategies do neither.
std::vector<Arrival> sampled_response(const StrategyOptions& options,
                                      std::span<const Source> sources,
                                      const std::vector<Emitter>& emitters,
                                      std::span<const Material> materials, const Air& air,
                                      const Vec3& listener_m, std::uint32_t emitter,
                                      const LateBoost& late_boost = {},
                                      const OcclusionGeometry* surfaces = nullptr);

}  // namespace clamor
