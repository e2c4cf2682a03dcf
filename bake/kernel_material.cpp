#include "bake/kernel_material.h"

#include <algorithm>
#include <numbers>

namespace clamor {

std::vector<KernelMaterial> kernel_materials(std::span<const Material> materials,
                                             PhongLobes& lobes) {
  std::vector<KernelMaterial> tables;
  for (const Material& material : materials) {
    KernelMaterial table;
    bool any_lobe = false;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float reflected = 1 - material.absorption[b];
      const float through = std::min(material.transmission[b], material.absorption[b]);
      table.kept[b] = reflected + through;
      table.through_of_kept[b] = through > 0 ? through / table.kept[b] : 0;
      table.reflected_of_kept[b] = 1 - table.through_of_kept[b];
      table.transmits |= through > 0;
      const bool lambert = material.scattering[b] >= 1 || material.phong[b] <= 0;
      table.scattering[b] = lambert ? 1 : material.scattering[b];
      const PhongLobe* const lobe = lambert ? nullptr : lobes.of(material.phong[b]);
      table.exponent[b] = lambert ? 0 : static_cast<float>(lobe->exponent());
      table.inverse_exponent[b] = 1 / (table.exponent[b] + 1);
      if (lambert) continue;
      any_lobe = true;
      const double rest = 1 - static_cast<double>(material.scattering[b]);
      table.lobes[b] = lobe;
      table.lobe[b] = static_cast<float>(rest * (lobe->exponent() + 1) / (2 * std::numbers::pi));
      table.compensation[b] =
          static_cast<float>(rest / (std::numbers::pi * (1 - lobe->mean_albedo())));
    }
    table.alike = std::all_of(table.scattering.begin(), table.scattering.end(),
                              [&](float s) { return s == table.scattering[0]; }) &&
                  std::all_of(table.exponent.begin(), table.exponent.end(),
                              [&](float p) { return p == table.exponent[0]; });
    if (any_lobe) {
      table.lost.resize(kLossCells + 1, Bands{});
      for (std::size_t k = 0; k <= kLossCells; ++k) {
        const double root = static_cast<double>(k) / kLossCells;
        for (std::size_t b = 0; b < kBandCount; ++b)
          if (table.lobes[b] != nullptr)
            table.lost[k][b] = static_cast<float>(1 - table.lobes[b]->albedo(root * root));
      }
    } else {
      table.lost.resize(kLossCells + 1, Bands{});
    }
    tables.push_back(std::move(table));
  }
  return tables;
}

}  // namespace clamor
