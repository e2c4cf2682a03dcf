// reflection_law-inl.h: the reflection law: its density f, its samples and its upper bound.
//
//   f = diffuse cos o + compensation loss(i) loss(o) cos o + lobe tilt cos^p(a),
//   tilt = min(1, cos o / cos i),   loss(x) = 1 - E(x),
//
// in the symbols of reflection.h, with the coefficients of ReflectionTable. The templates take
// double (reflection.cpp, the reference), float and vectors of bands (the photon tracer) and
// Highway's vectors (the runtime's kernels and bounds). Samples have f as their probability
// density, so it is also the pdf. Compiled once per instruction set; hence the unusual include
// guard.
#if defined(CLAMOR_COMMON_REFLECTION_LAW_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_COMMON_REFLECTION_LAW_INL_H
#undef CLAMOR_COMMON_REFLECTION_LAW_INL_H
#else
#define CLAMOR_COMMON_REFLECTION_LAW_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>

#include <hwy/highway.h>

#include "common/maths_lanes-inl.h"
#include "common/reflection_table.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

// --- Density ------------------------------------------------------------------------------------

// f. The two forms below differ from it by rounding only: results are compared bit by bit with
// those of earlier versions, so none may be replaced by another.
template <class F>
HWY_INLINE F density(F diffuse, F lobe, F compensation, F cos_o, F tilt, F power_of_base, F loss) {
  return diffuse * cos_o + compensation * loss * cos_o + lobe * tilt * power_of_base;
}

// power x f for a voice: `constant` is power x compensation x loss(i), which holds as long as the
// source, and is one row less to read.
template <class F>
HWY_INLINE F radiated(F power, F diffuse, F lobe, F constant, F cos_o, F tilt, F power_of_base,
                      F loss_o) {
  return power * (diffuse * cos_o + lobe * tilt * power_of_base) + constant * loss_o * cos_o;
}

// f for all bands of a photon, with one multiplication by cos o.
template <class V>
HWY_INLINE V photon_density(V scattering, V lobe, V compensation, float cos_o, float tilt,
                            V power_of_base, V loss_i, V loss_o) {
  return cos_o * (scattering * std::numbers::inv_pi_v<float> + compensation * loss_i * loss_o) +
         lobe * power_of_base * tilt;
}

template <class F>
HWY_INLINE F tilt_of(F cos_i, F cos_o) {
  const F least = F{} + 1e-9f, one = F{} + 1.0f;
  const F ratio = cos_o / (cos_i < least ? least : cos_i);
  return ratio < one ? ratio : one;
}
template <HighwayVector V>
HWY_INLINE V tilt_of(V cos_i, V cos_o) {
  return __builtin_bit_cast(V, tilt_of(lanes_of(cos_i), lanes_of(cos_o)));
}

// log2 of the base of cos^p: cos a of a surface, (1 + cos a) / 2 of an emitter. It is so low for a
// base near 0 that its power vanishes.
template <class F>
HWY_INLINE F log2_of_base(F base) {
  const F least = F{} + 1e-30f, one = F{} + 1.0f;
  const auto vanishes = base < least;
  return vanishes ? F{} - 1e30f : log2_of(vanishes ? one : base);
}
template <HighwayVector V>
HWY_INLINE V log2_of_base(V base) {
  return __builtin_bit_cast(V, log2_of_base(lanes_of(base)));
}

// Position of a cosine in the cells of ReflectionTable::loss, and the loss between two cells.
template <class F>
HWY_INLINE F loss_cell_of(F cos, F cells) {
  return std::sqrt(std::clamp(cos, F(0), F(1))) * cells;
}
template <HighwayVector V>
HWY_INLINE V loss_cell_of(V cos) {
  const hn::DFromV<V> d;
  return hn::Sqrt(hn::Min(hn::Max(cos, hn::Zero(d)), hn::Set(d, 1))) *
         hn::Set(d, ReflectionTable::kCells);
}
template <class F, class Share>
HWY_INLINE auto loss_between(F here, F next, Share share) {
  return here + share * (next - here);
}

// --- Samples ------------------------------------------------------------------------------------

// Lambert's share is sampled around the normal, with cos^2 = 1 - u of a random number u, the lobe
// around the mirror direction, and where that is not accepted, the compensation term
// (PhongLobe::draw_compensation_cos()). `rest` is 1 - u, inverse_exponent 1 / (p + 1).
template <class F>
HWY_INLINE F draw_lobe_cos(F rest, F inverse_exponent) {
  if constexpr (std::is_same_v<F, double>)
    return power(rest, inverse_exponent);
  else
    return exp2_of(log2_of(rest) * inverse_exponent);
}
template <class F>
HWY_INLINE bool accepts_lobe(F cos_i, F cos_o, F u) {
  return cos_o > 0 && u * cos_i <= cos_o;
}

// --- Upper bound --------------------------------------------------------------------------------

// exp(-t) for t >= 0, within 1e-4; never below 2^-100. Bounds need no more: exp2_of() takes half as
// many instructions again.
template <class V>
HWY_INLINE V decay(V t) {
  const hn::DFromV<V> d;
  const hn::RebindToSigned<decltype(d)> di;
  const V y = hn::Min(t * hn::Set(d, 1.44269504f), hn::Set(d, 100.0f));
  const V magic = hn::Set(d, 12582912.0f), rounded = y + magic;  // as in exp2_of()
  const V z = rounded - magic - y;  // 2^z, z in [-1/2, 1/2], by the Taylor series
  V part = hn::MulAdd(z, hn::Set(d, 0.00961813f), hn::Set(d, 0.05550411f));
  part = hn::MulAdd(part, z, hn::Set(d, 0.24022651f));
  part = hn::MulAdd(part, z, hn::Set(d, 0.69314718f));
  part = hn::MulAdd(part, z, hn::Set(d, 1.0f));
  const auto exponent = hn::Sub(hn::Set(di, 127), hn::BitCast(di, rounded));
  return part * hn::BitCast(d, hn::ShiftLeft<23>(exponent));
}

// f <= diffuse cos o + compensation x exp(-slope x) + lobe tilt exp(-p (1 - cos a)) with x =
// min(cos o, 1 / slope) and the coefficients of ReflectionLaws::UpperBound, since cos^p a <= exp(-p
// (1 - cos a)). x makes the second term grow with cos o, so that the maximum over directions is at
// the largest cos o.
template <class V>
HWY_INLINE V density_bound(V diffuse, V lobe, V compensation, V slope, V cos_o, V tilt,
                           V exponent_times_versine) {
  const hn::DFromV<V> d;
  slope = hn::Max(slope, hn::Set(d, 1e-6f));
  const V x = hn::Min(cos_o, hn::Set(d, 1.0f) / slope);
  return hn::MulAdd(
      diffuse, cos_o,
      compensation * x * decay(slope * x) + lobe * tilt * decay(exponent_times_versine));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
