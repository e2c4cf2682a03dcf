// kernel_material.h: what a surface does, as tables in the order in which the trace kernel reads
// them.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/material.h"
#include "common/reflection.h"

namespace clamor {

// A material's numbers in the order in which lanes read them.
struct alignas(64) KernelMaterial {
  Bands kept{};               // share of the power that goes on: reflected and let through
  Bands reflected_of_kept{};  // of which reflected,
  Bands through_of_kept{};    // and let through
  Bands scattering{}, exponent{}, inverse_exponent{};  // 1 / (p + 1)
  Bands lobe{}, compensation{};                        // factors of the law's two terms
  bool alike = false;                                  // one law in all bands
  bool transmits = false;
  std::vector<Bands> lost;  // 1 - E at cos = (k / kLossCells)^2; 0 in bands that are all Lambert
  std::array<const PhongLobe*, kBandCount> lobes{};
};

inline constexpr std::size_t kLossCells = 256;

// The tables of the materials; `lobes` keeps what they point to.
std::vector<KernelMaterial> kernel_materials(std::span<const Material> materials,
                                             PhongLobes& lobes);

}  // namespace clamor
