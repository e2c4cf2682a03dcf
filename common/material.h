// material.h: acoustic properties of a surface, per octave band.
#pragma once

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

}  // namespace clamor
