// kernel_material.h: the surface properties that the trace kernel reads, as rows of bands.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/material.h"
#include "common/reflection.h"
#include "common/reflection_table.h"

namespace clamor {

struct alignas(64) KernelMaterial {
  Bands reflectance_plus_transmittance{};  // share of the power that is reflected or transmitted
  Bands reflected_fraction{};              // reflected share of that,
  Bands transmitted_fraction{};            // and transmitted share
  Bands inverse_exponent{};                // 1 / (p + 1)
  ReflectionTable brdf;            // of reflection and, around the other side, of transmission
  bool same_in_all_bands = false;  // the BRDF
  // A mirror reflects what it does not scatter in exactly the mirror direction. Deposits of what it
  // scatters alone have a material of their own, the last of deposit_materials().
  bool is_mirror = false;
  std::uint16_t scattered_share = 0;
  bool transmits = false;
  std::array<const PhongLobe*, kBandCount> lobes{};  // null for a fully diffuse band
};

// The materials of deposits and secondary sources: the level's, and behind these, if any of them is
// a mirror, one for what mirrors scatter.
std::vector<Material> deposit_materials(std::span<const Material> materials);

// One per material of `laws`, which must outlive them.
std::vector<KernelMaterial> kernel_materials(std::span<const Material> materials,
                                             const ReflectionLaws& laws);

}  // namespace clamor
