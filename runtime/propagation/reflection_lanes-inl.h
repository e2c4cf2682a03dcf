// reflection_lanes-inl.h: how kernels ask for reflection laws (reflection_table.h), in every lane.
//
// For field/intensity_kernel.cpp and mixing/voice_kernel.cpp alone, which compile it once per
// instruction set; hence no include guard of the usual kind.
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
using Halves = hn::Rebind<float, Doubles>;  // as many floats
using Eight = hn::CappedTag<float, kBandCount>;

// Where a cosine is among the cells of `loss`.
template <class D, class V>
HWY_INLINE V loss_cell_of(D d, V cos) {
  return hn::Mul(hn::Sqrt(hn::Min(hn::Max(cos, hn::Zero(d)), hn::Set(d, 1.0f))),
                 hn::Set(d, 1.0f * ReflectionTable::kCells));
}

// log2 of what p is a power of: cos a where `lift` is 0; for an emitter, whose `lift` is 1/2,
// (1 + cos a) / 2. So low that nothing is left of it where that is 0.
template <class D, class V>
HWY_INLINE V log_base_of(D d, V lift, V cos_a) {
  const auto one = hn::Set(d, 1.0f);
  const auto base = hn::Add(lift, hn::Mul(hn::Sub(one, lift), cos_a));
  const auto none = hn::Lt(base, hn::Set(d, 1e-30f));
  return hn::IfThenElse(none, hn::Set(d, -1e30f), log2_of(d, hn::IfThenElse(none, one, base)));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
