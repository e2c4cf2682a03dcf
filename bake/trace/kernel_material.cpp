#include "bake/trace/kernel_material.h"

#include <algorithm>
#include <numbers>

namespace clamor {

std::vector<KernelMaterial> kernel_materials(std::span<const Material> materials,
                                             PhongLobes& lobes) {
  std::vector<KernelMaterial> tables;
  for (const Material& material : materials) {
    KernelMaterial table;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float reflected = 1 - material.absorption[b];
      const float through = std::min(material.transmission[b], material.absorption[b]);
      table.kept[b] = reflected + through;
      table.through_of_kept[b] = through > 0 ? through / table.kept[b] : 0;
      table.reflected_of_kept[b] = 1 - table.through_of_kept[b];
      table.transmits |= through > 0;
      const PhongLobe* const lobe = table.lobes[b] = lobes.of(material, b);
      table.scattering[b] = lobe != nullptr ? material.scattering[b] : 1;
      table.exponent[b] = lobe != nullptr ? static_cast<float>(lobe->exponent()) : 0;
      table.inverse_exponent[b] = 1 / (table.exponent[b] + 1);
      if (lobe == nullptr) continue;
      const double rest = 1 - static_cast<double>(material.scattering[b]);
      table.lobe[b] = static_cast<float>(rest * (lobe->exponent() + 1) / (2 * std::numbers::pi));
      table.compensation[b] =
          static_cast<float>(rest / (std::numbers::pi * (1 - lobe->mean_albedo())));
    }
    table.alike = std::all_of(table.scattering.begin(), table.scattering.end(),
                              [&](float s) { return s == table.scattering[0]; }) &&
                  std::all_of(table.exponent.begin(), table.exponent.end(),
                              [&](float p) { return p == table.exponent[0]; });
    table.lost.resize(kLossCells + 1, Bands{});
    for (std::size_t k = 0; k <= kLossCells; ++k) {
      const double root = static_cast<double>(k) / kLossCells;
      for (std::size_t b = 0; b < kBandCount; ++b)
        if (table.lobes[b] != nullptr)
          table.lost[k][b] = static_cast<float>(1 - table.lobes[b]->albedo(root * root));
    }
    tables.push_back(std::move(table));
  }
  return tables;
}

}  // namespace clamor
