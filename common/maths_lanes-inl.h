// maths_lanes-inl.h: functions of maths.h for vectors of floats, with the same bits.
//
// Compiled once per instruction set; hence the unusual include guard.
#if defined(CLAMOR_COMMON_MATHS_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_COMMON_MATHS_LANES_INL_H
#undef CLAMOR_COMMON_MATHS_LANES_INL_H
#else
#define CLAMOR_COMMON_MATHS_LANES_INL_H
#endif

#include <hwy/highway.h>

#include "common/bands.h"
#include "common/maths.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;
using Halves = hn::Rebind<float, Doubles>;  // same number of floats
using Eight = hn::CappedTag<float, kBandCount>;

#include "common/maths_series-inl.h"

// log2_of() and exp2_of() of Highway's vectors, computed in those of the compiler.
template <class V>
concept HighwayVector = requires(V x) {
  x.raw;
};
template <HighwayVector V>
HWY_INLINE auto lanes_of(V x) {
  typedef float Lanes __attribute__((vector_size(sizeof(V))));
  return __builtin_bit_cast(Lanes, x);
}
template <HighwayVector V>
HWY_INLINE V log2_of(V x) {
  return __builtin_bit_cast(V, log2_of(lanes_of(x)));
}
template <HighwayVector V>
HWY_INLINE V exp2_of(V x) {
  return __builtin_bit_cast(V, exp2_of(lanes_of(x)));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
