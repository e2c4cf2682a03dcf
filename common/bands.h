// bands.h: the eight octave bands in which sound is traced, stored and mixed.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace clamor {

// Code that is built for eight bands says so in a static_assert: git grep "kBandCount == 8".
inline constexpr std::size_t kBandCount = 8;

// Nominal octave-band centres (IEC 61260-1), for formulas and for tables.
inline constexpr std::array<double, kBandCount> kBandCentres_hz = {63,   125,  250,  500,
                                                                   1000, 2000, 4000, 8000};
static_assert(kBandCentres_hz.back() > 0, "a band has no centre");

// One value per octave band: a power, a gain, an absorption, an exponent.
using Bands = std::array<float, kBandCount>;

constexpr Bands same_in_all_bands(float value) {
  Bands bands{};
  bands.fill(value);
  return bands;
}

// The sum over all bands, in double and in their order.
constexpr double sum_of(const Bands& bands) {
  double sum = 0;
  for (const float band : bands) sum += static_cast<double>(band);
  return sum;
}

// Resamples values at ascending frequencies to the eight bands: linear in frequency between the
// points (the paper, section 4), constant beyond the first and the last. `hz` and `values` have the
// same, non-zero length; one value is for all bands.
Bands bands_from_points(std::span<const double> hz, std::span<const double> values);

}  // namespace clamor
