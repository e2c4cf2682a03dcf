// source.h: a point source, as the bake stores it and the sampler reads it.
#pragma once

#include <cstdint>

#include "common/bands.h"
#include "common/vec.h"

namespace clamor {

// An emitter, or a secondary source: sound reflected at a point of a surface.
//
// Power has the unit intensity x area, where intensity 1 is that of an emitter of gain 1 at 1 m on
// its axis, playing a full-scale signal; so an omnidirectional emitter of gain g has power 4 pi
// g^2. A secondary source radiates I = power x density(direction) / r^2 with the density of the
// reflection law of its material. Power includes air attenuation up to the source, but not beyond.
struct Source {
  Vec3f position_m{};
  Vec3f normal{};            // unit; towards the side of incidence. Emitter: axis
  Vec3f mirror{};            // unit; mirror direction of the incident sound. Emitter: axis
  float delay_s = 0;         // path delay since the emitter; 0 for an emitter
  Bands power{};             // reflected power
  float patch_radius_m = 0;  // 1 / r^2 is clamped at this distance; 0 for an emitter
  float u = 1;               // permanent random number of priority sampling, in (0, 1]
  std::uint32_t emitter = 0;
  std::uint16_t material = 0;
  std::int8_t polarity = 1;     // +1 or -1 at random, so that powers add on average
  bool is_emitter : 1 = false;  // then the emitter table defines everything but u
  // An emitter's mirror image (image_source.h), which radiates as an emitter does. It is at
  // `position_m`, its axis is `normal`, and `mirror` holds the place of the emitter.
  bool is_image : 1 = false;
};

}  // namespace clamor
