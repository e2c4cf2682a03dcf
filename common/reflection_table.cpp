#include "common/reflection_table.h"

#include <numbers>

namespace clamor {

ReflectionTable reflection_table(const ReflectionLaws& laws, std::size_t material) {
  ReflectionTable table;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    table.scattering[b] = laws.scattering(material, b);
    const double scattering = static_cast<double>(table.scattering[b]);
    table.diffuse[b] = static_cast<float>(scattering / std::numbers::pi);
    const PhongLobe* const lobe = laws.lobe(material, b);
    if (lobe == nullptr) continue;
    table.loss.resize(ReflectionTable::kCells + 1);
    table.exponent[b] = static_cast<float>(lobe->exponent());
    table.lobe[b] =
        static_cast<float>((1 - scattering) * (lobe->exponent() + 1) / (2 * std::numbers::pi));
    table.compensation[b] =
        static_cast<float>((1 - scattering) / (std::numbers::pi * (1 - lobe->mean_albedo())));
    for (std::size_t k = 0; k < table.loss.size(); ++k) {
      const double root = static_cast<double>(k) / ReflectionTable::kCells;
      table.loss[k][b] = static_cast<float>(1 - lobe->albedo(root * root));
    }
  }
  return table;
}

}  // namespace clamor
