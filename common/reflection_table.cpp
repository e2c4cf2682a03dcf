#include "common/reflection_table.h"

#include <numbers>

namespace clamor {

ReflectionTable reflection_table(const ReflectionLaws& laws, std::size_t material) {
  ReflectionTable rows;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const double scattering = static_cast<double>(laws.scattering(material, b));
    rows.diffuse[b] = static_cast<float>(scattering / std::numbers::pi);
    const PhongLobe* const lobe = laws.lobe(material, b);
    if (lobe == nullptr) continue;
    rows.loss.resize(ReflectionTable::kCells + 1);
    rows.exponent[b] = static_cast<float>(lobe->exponent());
    rows.lobe[b] =
        static_cast<float>((1 - scattering) * (lobe->exponent() + 1) / (2 * std::numbers::pi));
    rows.bounce[b] =
        static_cast<float>((1 - scattering) / (std::numbers::pi * (1 - lobe->mean_albedo())));
    for (std::size_t k = 0; k < rows.loss.size(); ++k) {
      const double root = static_cast<double>(k) / ReflectionTable::kCells;
      rows.loss[k][b] = static_cast<float>(1 - lobe->albedo(root * root));
    }
  }
  return rows;
}

}  // namespace clamor
