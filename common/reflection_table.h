// reflection_table.h: a reflection law as numbers side by side, one per band, for kernels to read.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "common/bands.h"
#include "common/reflection.h"

namespace clamor {

// The density of reflection.h, per band, as
//
//   f = diffuse cos o + lobe min(1, cos o / cos i) cos^p(a) + bounce loss(cos i) loss(cos o) cos o
//
// where p = exponent, and loss = 1 - E is tabled over the root of a cosine.
struct ReflectionTable {
  static constexpr int kCells = 256;

  Bands diffuse{}, lobe{}, exponent{}, bounce{};
  std::vector<Bands> loss;  // kCells + 1 of them; none if it is all diffuse

  // The cell that a place among them is in; the first for what is not a number.
  static int cell_at(float place) { return std::clamp(static_cast<int>(place), 0, kCells - 1); }
};

ReflectionTable reflection_table(const ReflectionLaws& laws, std::size_t material);

}  // namespace clamor
