// maths_lanes-inl.h: functions of maths.h for Highway vectors, with the same bits.
//
// Compiled once per instruction set; hence the unusual include guard.
#if defined(CLAMOR_COMMON_MATHS_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_COMMON_MATHS_LANES_INL_H
#undef CLAMOR_COMMON_MATHS_LANES_INL_H
#else
#define CLAMOR_COMMON_MATHS_LANES_INL_H
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

// log2(x) for normal x > 0.
template <class D, class V>
HWY_INLINE V log2_of(D d, V x) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  const auto bits = hn::BitCast(di, x);
  const auto exponent = hn::ShiftRight<23>(hn::Sub(bits, hn::Set(di, 0x3f3504f3)));
  const auto m = hn::BitCast(d, hn::Sub(bits, hn::ShiftLeft<23>(exponent)));
  const auto one = hn::Set(d, 1.0f);
  const auto t = hn::Div(hn::Sub(m, one), hn::Add(m, one));
  const auto t2 = hn::Mul(t, t);
  auto series = hn::Add(hn::Set(d, 0.412198583f), hn::Mul(t2, hn::Set(d, 0.3205989f)));
  series = hn::Add(hn::Set(d, 0.577078016f), hn::Mul(t2, series));
  series = hn::Add(hn::Set(d, 0.961796694f), hn::Mul(t2, series));
  series = hn::Add(hn::Set(d, 2.88539008f), hn::Mul(t2, series));
  return hn::Add(hn::ConvertTo(d, exponent), hn::Mul(t, series));
}

// 2^x for x <= 0; never below 2^-126.
template <class D, class V>
HWY_INLINE V exp2_of(D d, V x) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  x = hn::Max(x, hn::Set(d, -126.0f));
  const auto magic = hn::Set(d, 12582912.0f);
  const auto n = hn::Sub(hn::Add(x, magic), magic);  // rounds to the nearest integer
  const auto f = hn::Sub(x, n);
  const auto f2 = hn::Mul(f, f);
  const auto pair = [&](float a, float b) {
    return hn::Add(hn::Set(d, a), hn::Mul(f, hn::Set(d, b)));
  };
  const auto low =
      hn::Add(pair(1.0f, 0.693147181f), hn::Mul(f2, pair(0.240226507f, 5.55041087e-2f)));
  const auto high = hn::Add(pair(9.61812911e-3f, 1.33335581e-3f),
                            hn::Mul(f2, pair(1.54035304e-4f, 1.52527338e-5f)));
  const auto series = hn::Add(low, hn::Mul(hn::Mul(f2, f2), high));
  const auto scale = hn::ShiftLeft<23>(hn::Add(hn::ConvertTo(di, n), hn::Set(di, 127)));
  return hn::Mul(series, hn::BitCast(d, scale));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
