// source.h: a place that sound comes from, as the bake leaves it and the sampler reads it.
#pragma once

#include <cstdint>

#include "common/bands.h"
#include "common/vec.h"

namespace clamor {

// An emitter itself, or what a surface reflects of it: a secondary source.
//
// Power is in units of intensity x area, with intensity 1 an emitter of gain 1 heard at 1 m on its
// axis playing a full-scale signal; so an omnidirectional emitter of gain g has 4 pi g^2. A
// secondary source radiates I = power x density(direction) / r^2, the density being its material's
// reflection law. Air losses up to the source are included, those after it are not.
struct Source {
  Vec3f position_m{};
  Vec3f normal{};     // unit; out of the surface, on the side the sound came from. Emitter: axis
  Vec3f mirror{};     // unit; mirror direction of the arriving sound. Emitter: axis
  float delay_s = 0;  // travelled since the emitter; 0 for an emitter
  Bands power{};      // reflected power per band
  float patch_radius_m = 0;  // 1 / r^2 is clamped there; 0 for an emitter
  float u = 1;               // the permanent random number of priority sampling, in (0, 1]
  std::uint32_t emitter = 0;
  std::uint16_t material = 0;
  std::int8_t polarity = 1;  // +1 or -1, so that powers add and not amplitudes
  bool is_emitter = false;   // then everything but u follows from the emitter table
};

}  // namespace clamor
