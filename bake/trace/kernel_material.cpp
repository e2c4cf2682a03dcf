#include "bake/trace/kernel_material.h"

#include <algorithm>
#include <cassert>

namespace clamor {

namespace {

bool is_constant(const Bands& bands) {
  return std::all_of(bands.begin(), bands.end(), [&](float value) { return value == bands[0]; });
}

}  // namespace

std::vector<Material> deposit_materials(std::span<const Material> materials) {
  std::vector<Material> all(materials.begin(), materials.end());
  if (std::ranges::any_of(materials, is_mirror))
    all.push_back(diffuse_material("scattered by mirrors"));
  return all;
}

std::vector<KernelMaterial> kernel_materials(std::span<const Material> materials,
                                             const ReflectionLaws& laws) {
  std::vector<KernelMaterial> tables;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const Material& material = materials[m];
    assert(conserves_energy(material));
    KernelMaterial table;
    table.brdf = reflection_table(laws, m);
    table.same_in_all_bands =
        is_constant(table.brdf.scattering) && is_constant(table.brdf.exponent);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float reflected = 1 - material.absorption[b];
      const float transmitted = material.transmission[b];
      table.reflectance_plus_transmittance[b] = reflected + transmitted;
      table.transmitted_fraction[b] =
          transmitted > 0 ? transmitted / table.reflectance_plus_transmittance[b] : 0;
      table.reflected_fraction[b] = 1 - table.transmitted_fraction[b];
      table.transmits |= transmitted > 0;
      table.inverse_exponent[b] = is_mirror(material) ? 0 : 1 / (table.brdf.exponent[b] + 1);
      table.lobes[b] = laws.lobe(m, b);
    }
    table.is_mirror = is_mirror(material);
    table.scattered_share = static_cast<std::uint16_t>(materials.size());
    tables.push_back(std::move(table));
  }
  return tables;
}

}  // namespace clamor
