// material.h: acoustic properties of a surface, per octave band.
#pragma once

#include <cstddef>
#include <string>

#include "common/bands.h"

namespace clamor {

// An exponent from here on means a mirror. Sound that a mirror reflects leaves in exactly the
// mirror direction; a lobe with this exponent would be one degree wide.
inline constexpr float kMirrorExponent = 10'000;
inline constexpr float kDefaultPhong = kMirrorExponent;

// The last reflection of sound off a mirror reaches a listener through a lobe with this exponent,
// except for early specular paths, which are image sources. Photons meet a surface at points, none
// of which is exactly where a listener sees a mirror image; the lobe spreads the power of each over
// listeners round it. 20 is the exponent of the paper's "specular" violin room (section 5.2).
inline constexpr float kMirrorLobe = 20;
// The lobe of a mirror whose material is none in another band.
inline constexpr float kSharpestLobe = 1000;

inline constexpr double kDeepestRows_m = 3;

struct Material {
  std::string name;
  Bands absorption{};                       // fraction of incident power not reflected
  Bands scattering = same_in_all_bands(1);  // fraction of reflected power that is diffuse
  // Exponent of the specular lobe: 0 (Lambert's law) to 1000, or a mirror.
  Bands phong = same_in_all_bands(kDefaultPhong);
  Bands transmission{};  // fraction of incident power; at most absorption
  // Depth of the gaps between rows of seats whose tops the surface is (runtime/occlusion/
  // seat_rows.h); 0: no rows.
  float rows_m = 0;

  bool operator==(const Material&) const = default;
};

// Returns whether no band transmits more than it absorbs. The level import and the reader of bake
// files clamp transmission, so that all other code can rely on it.
inline bool conserves_energy(const Material& material) {
  for (std::size_t b = 0; b < kBandCount; ++b)
    if (material.transmission[b] > material.absorption[b]) return false;
  return true;
}

// Returns whether all of what is not scattered is reflected as by a mirror.
inline bool is_mirror(const Material& material) {
  bool reflects = false;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    if (material.scattering[b] >= 1) continue;
    if (material.phong[b] < kMirrorExponent) return false;
    reflects = true;
  }
  return reflects;
}

// Share of the power that a material reflects as a mirror; 0 if it is none.
inline Bands mirror_reflection(const Material& material) {
  Bands share{};
  for (std::size_t b = 0; b < kBandCount && is_mirror(material); ++b)
    share[b] = (1 - material.absorption[b]) * (1 - material.scattering[b]);
  return share;
}

// A material that reflects by the cosine law.
inline Material diffuse_material(const std::string& name) {
  Material material;
  material.name = name;
  material.scattering = same_in_all_bands(1);
  return material;
}

// The exponent of the lobe through which a listener hears a band. A material with some bands that
// are mirrors and others that are not has no exact mirror direction.
inline float heard_exponent(const Material& material, std::size_t band) {
  if (material.phong[band] < kMirrorExponent) return material.phong[band];
  return is_mirror(material) ? kMirrorLobe : kSharpestLobe;
}

}  // namespace clamor
