// material.h: what a surface does to the sound that hits it.
#pragma once

#include <string>

#include "common/bands.h"

namespace clamor {

// Exponent of the specular lobe where a material does not say: the paper's "specular" violin room
// (section 5.2).
inline constexpr float kDefaultPhong = 20;

struct Material {
  std::string name;
  Bands absorption{};                              // share of the power that is lost, 0 to 1
  Bands scattering = same_in_all_bands(1);         // Lambert's share of the rest, 0 to 1
  Bands phong = same_in_all_bands(kDefaultPhong);  // exponent of the specular share, 0 to 1000
  Bands transmission{};                            // share of the power let through, 0 to 1

  bool operator==(const Material&) const = default;
};

}  // namespace clamor
