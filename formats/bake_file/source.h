// source.h: a point source, as the bake stores it and the sampler reads it.
#pragma once

#include <cstdint>

#include "common/bands.h"
#include "common/vec.h"

namespace clamor {

// How sound came from a probe to a source. A page stores both in the place of an emitter.
struct ProbePath {
  std::uint32_t first_leg : 20;   // a code (first_leg.h)
  std::uint32_t portal_set : 12;  // of the portals that it passed (baked_portals.h)
};

// An emitter, or a secondary source: sound reflected at a point of a surface.
//
// Power has the unit intensity x area, where intensity 1 is that of an emitter of gain 1 at 1 m on
// its axis, playing a full-scale signal; so an omnidirectional emitter of gain g has power 4 pi
// g^2. A secondary source radiates I = power x density(direction) / r^2 with the density of the
// reflection law of its material. Power includes air attenuation up to the source, but not beyond.
//
// An image (image_source.h) is an emitter elsewhere, whose sound arrives only by way of mirrors.
struct Source {
  Vec3f position_m{};
  Vec3f normal{};  // unit; towards the side of incidence. Emitter: axis
  union {
    Vec3f mirror{};    // unit; mirror direction of the incident sound. Emitter: axis
    Vec3f original_m;  // of an image: where the emitter is
  };
  float delay_s = 0;         // path delay since the emitter; 0 for an emitter
  Bands power{};             // reflected power
  float patch_radius_m = 0;  // 1 / r^2 is clamped at this distance; 0 for an emitter
  float u = 1;               // permanent random number of priority sampling, in (0, 1]
  union {
    // Index in the list of emitters that comes with the sources: those of the level, then virtual
    // ones (baked_portals.h; while a bake runs, PortalPairs), then kinds of moving sources.
    std::uint32_t emitter = 0;
    ProbePath path;  // of a probe's source, instead
  };
  std::uint16_t material = 0;
  std::int8_t polarity = 1;     // +1 or -1 at random, so that powers add on average
  bool is_emitter : 1 = false;  // then the emitter table defines everything but u
  bool is_image : 1 = false;    // only if is_emitter
  bool is_in_part : 1 = false;  // of an image: a movable part is its mirror, not the level

  // Axis of the lobe that it radiates.
  const Vec3f& axis() const { return is_emitter ? normal : mirror; }
};

}  // namespace clamor
