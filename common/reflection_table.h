// reflection_table.h: the BRDF of a material as rows of bands, for vectorised evaluation.
//
// The photon tracer and the runtime's kernels evaluate these tables by reflection_law-inl.h.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "common/bands.h"
#include "common/reflection.h"

namespace clamor {

// diffuse = scattering / pi, p = exponent and loss = 1 - E, tabulated over sqrt(cosine).
struct ReflectionTable {
  static constexpr int kCells = 256;

  Bands scattering{}, diffuse{}, lobe{}, exponent{}, compensation{};
  std::vector<Bands> loss;  // kCells + 1 rows; none if all bands are fully diffuse

  // Cell of a position in `loss`, clamped; the first cell for NaN.
  static int cell_at(float place) { return std::clamp(static_cast<int>(place), 0, kCells - 1); }
};

ReflectionTable reflection_table(const ReflectionLaws& laws, std::size_t material);

}  // namespace clamor
