// field_kernel.h: the vector loops of the field: taps, bands and spectra.
//
// Highway is visible only in field_kernel.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bands.h"
#include "runtime/field/field_response.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

// Lanes of the layers: of the high one the four upper bands, of the low one all. The band below the
// split has a lane in both, because bands overlap.
inline constexpr std::size_t kHighFieldLanes = 4, kLowFieldLanes = kBandCount;

// A source at one ear: its delay in frames of each layer. In the high layer the fraction is that
// after the whole part; in the low layer it is from the nearest frame, -1/2 to 1/2.
struct Tap {
  std::int32_t high, low;
  float high_fraction, low_fraction;
  float amplitude;
  const Bands* gain;  // times the amplitude
};

// Adds splines at the taps' delays to rows of lanes: cubic in the high layer, quadratic in the low
// one, whose signals end at a quarter of its rate.
void add_taps(std::span<const Tap> taps, float* high, float* low);

// Sums over lanes of `spectrum` times `filters`, both [point][8]: the first four lanes make one sum
// and the others another, or all eight the first one if there is no other.
void join_bands(const float* spectrum, const float* filters, std::size_t points, float* sum,
                float* other);

// Turns a spectrum into the form in which it is kept.
void pack(const FieldSums& from, FieldSpectrum& to) noexcept REALTIME;

// Adds products of two spectra each to a sum.
struct SpectrumProduct {
  const FieldSpectrum *a, *b;
};
void multiply_add(std::span<const SpectrumProduct> products, FieldSums& sum) noexcept REALTIME;

// Adds the products of two spectra to their power and correlation at each point.
struct SpectrumSums {
  float *power, *last_power, *correlation;
};
void correlate(const FieldSpectrum& now, const FieldSpectrum& last, const SpectrumSums& high,
               const SpectrumSums& low);

}  // namespace clamor
