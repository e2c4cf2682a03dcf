// energy_response.h: every sound of an impulse that reaches a listener, and when.
//
// This is what the bake knows before any chance of phase comes in: powers add, nothing interferes.
// Room-acoustic parameters are exact on it, and the waveform (impulse_response.h) is made from it.
//
// A source is heard if it radiates towards the listener and as far as it gets past the surfaces in
// between (fresnel_visibility.h), with so many rays that more would not change it by 1 dB: seconds
// for 100 000 sources, on all cores.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/air.h"
#include "common/bands.h"
#include "common/material.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/emitter.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

// One pulse of the response.
struct Arrival {
  double time_s = 0;  // since the impulse left the emitter
  Bands energy{};     // intensity, 1 being an emitter of gain 1 at 1 m on its axis
  int polarity = 1;   // +1 or -1, of its pressure; means nothing to the energy
};

// The arrivals at an omnidirectional receiver, by time, of an impulse that every emitter, or the
// given one alone, sends at time 0 (whatever the start delay of its signal). Arrivals without
// energy are left out. The order is a function of the sources' order alone. Without `surfaces`
// nothing stands in the way.
std::vector<Arrival> energy_response(std::span<const Source> sources,
                                     const std::vector<Emitter>& emitters,
                                     std::span<const Material> materials, const Air& air,
                                     const Vec3& listener_m, std::optional<std::uint32_t> emitter,
                                     const OcclusionGeometry* surfaces = nullptr);

}  // namespace clamor
