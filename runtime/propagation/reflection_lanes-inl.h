// reflection_lanes-inl.h: evaluates the BRDF (reflection_table.h) and air attenuation in Highway
// vectors.
//
// For propagation/intensity_kernel.cpp and mixing/voice_kernel.cpp, which compile it once per
// instruction set; hence the unusual include guard.
#if defined(CLAMOR_RUNTIME_REFLECTION_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_RUNTIME_REFLECTION_LANES_INL_H
#undef CLAMOR_RUNTIME_REFLECTION_LANES_INL_H
#else
#define CLAMOR_RUNTIME_REFLECTION_LANES_INL_H
#endif

#include <hwy/highway.h>

#include "common/bands.h"
#include "common/maths_lanes-inl.h"
#include "common/reflection_table.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;
using Halves = hn::Rebind<float, Doubles>;  // same number of floats
using Eight = hn::CappedTag<float, kBandCount>;

// Position of a cosine in the cells of ReflectionTable::loss.
template <class D, class V>
HWY_INLINE V loss_cell_of(D d, V cos) {
  return hn::Mul(hn::Sqrt(hn::Min(hn::Max(cos, hn::Zero(d)), hn::Set(d, 1.0f))),
                 hn::Set(d, 1.0f * ReflectionTable::kCells));
}

// log2 of the base of cos^p: cos a for surfaces (lift 0), (1 + cos a) / 2 for emitters (lift 1/2).
// For a base near 0 the result is so low that its power vanishes.
template <class D, class V>
HWY_INLINE V log_base_of(D d, V lift, V cos_a) {
  const auto one = hn::Set(d, 1.0f);
  const auto base = hn::Add(lift, hn::Mul(hn::Sub(one, lift), cos_a));
  const auto none = hn::Lt(base, hn::Set(d, 1e-30f));
  return hn::IfThenElse(none, hn::Set(d, -1e30f), log2_of(d, hn::IfThenElse(none, one, base)));
}

// The terms of the law (reflection_table.h) per band: diffuse cos o; lobe x tilt x base^p with tilt
// = min(1, cos o / cos i); and compensation x loss x cos o.
template <class V>
HWY_INLINE V diffuse_term(V diffuse, V cos_o) {
  return hn::Mul(diffuse, cos_o);
}
template <class V>
HWY_INLINE V lobe_term(V lobe, V tilt, V power_of_base) {
  return hn::Mul(hn::Mul(lobe, tilt), power_of_base);
}
template <class V>
HWY_INLINE V compensation_term(V compensation, V loss, V cos_o) {
  return hn::Mul(hn::Mul(compensation, loss), cos_o);
}

// The loss between two cells of ReflectionTable::loss.
template <class V>
HWY_INLINE V loss_between(V here, V next, V share) {
  return hn::Add(here, hn::Mul(share, hn::Sub(next, here)));
}

// The share of energy that air transmits over a distance.
template <class D, class V>
HWY_INLINE V air_transmittance_of(D d, V log2_loss_per_m, V minus_distance_m) {
  return exp2_of(d, hn::Mul(log2_loss_per_m, minus_distance_m));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
