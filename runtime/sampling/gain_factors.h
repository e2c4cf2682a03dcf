// gain_factors.h: what the power of a chosen source is multiplied with, beside its intensity at the
// listener (radiation_model.h) and its scale by sampling (sampler.h).
#pragma once

#include <cstddef>

#include "common/bands.h"

namespace clamor {

struct GainFactors {
  Bands occlusion = same_in_all_bands(1);  // share of the power that passes obstacles
  float portals = 1;                       // share that the portals on its path let through
  float emitter = 1;                       // the application's gain of its emitter, squared
  float detour = 1;  // (path / straight distance)^2 around an edge; occlusion holds its inverse
};

// The product of all factors, per band. A voice's gain is the square root of its intensity, its
// scale and this product (voice_kernel.cpp).
inline Bands power_gain(const GainFactors& f) {
  Bands gain;
  for (std::size_t b = 0; b < kBandCount; ++b)
    gain[b] = f.occlusion[b] * (f.portals * f.emitter) * f.detour;
  return gain;
}

}  // namespace clamor
