// material.h: acoustic properties of a surface, per octave band.
#pragma once

#include <cstddef>
#include <string>

#include "common/bands.h"

namespace clamor {

// Default exponent of the specular lobe: the paper's "specular" violin room (section 5.2).
inline constexpr float kDefaultPhong = 20;

struct Material {
  std::string name;
  Bands absorption{};                              // fraction of incident power not reflected
  Bands scattering = same_in_all_bands(1);         // fraction of reflected power that is diffuse
  Bands phong = same_in_all_bands(kDefaultPhong);  // exponent of the specular lobe, 0 to 1000
  Bands transmission{};                            // fraction of incident power; at most absorption

  bool operator==(const Material&) const = default;
};

// Returns whether no band transmits more than it absorbs. The level import and the reader of bake
// files clamp transmission, so that all other code can rely on it.
inline bool conserves_energy(const Material& material) {
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (material.transmission[b] > material.absorption[b]) return false;
  return true;
}

}  // namespace clamor
