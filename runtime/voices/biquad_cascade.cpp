#include "runtime/voices/biquad_cascade.h"

// Highway compiles everything below once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/voices/biquad_cascade.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

template <int kLanes, int kSections>
HWY_INLINE void filter(BiquadCascade<kLanes, kSections>& cascade, double* HWY_RESTRICT lanes,
                       int frames) {
  const hn::CappedTag<double, 8> d;
  using Vector = hn::Vec<decltype(d)>;
  constexpr int kDoubles = static_cast<int>(hn::MaxLanes(d));
  constexpr int kTogether = 2;  // sections whose state is in registers
  static_assert(kSections % kTogether == 0 && kLanes % kDoubles == 0);
  for (int first = 0; first < kSections; first += kTogether)
    for (int lane = 0; lane < kLanes; lane += kDoubles) {
      Vector b0[kTogether], b1[kTogether], b2[kTogether], a1[kTogether], a2[kTogether];
      Vector s1[kTogether], s2[kTogether];
      for (int k = 0; k < kTogether; ++k) {
        const auto& section = cascade.section[first + k];
        b0[k] = hn::Load(d, section.b0 + lane);
        b1[k] = hn::Load(d, section.b1 + lane);
        b2[k] = hn::Load(d, section.b2 + lane);
        a1[k] = hn::Load(d, section.a1 + lane);
        a2[k] = hn::Load(d, section.a2 + lane);
        s1[k] = hn::Load(d, cascade.memory[first + k].s1 + lane);
        s2[k] = hn::Load(d, cascade.memory[first + k].s2 + lane);
      }
      for (int f = 0; f < frames; ++f) {
        auto x = hn::Load(d, lanes + f * kLanes + lane);
        for (int k = 0; k < kTogether; ++k) {
          const auto y = hn::MulAdd(b0[k], x, s1[k]);
          s1[k] = hn::NegMulAdd(a1[k], y, hn::MulAdd(b1[k], x, s2[k]));
          s2[k] = hn::NegMulAdd(a2[k], y, hn::Mul(b2[k], x));
          x = y;
        }
        hn::Store(x, d, lanes + f * kLanes + lane);
      }
      for (int k = 0; k < kTogether; ++k) {
        hn::Store(s1[k], d, cascade.memory[first + k].s1 + lane);
        hn::Store(s2[k], d, cascade.memory[first + k].s2 + lane);
      }
    }
}

void filter_high_here(HighCascade& cascade, double* lanes, int frames) {
  filter(cascade, lanes, frames);
}
void filter_low_here(LowCascade& cascade, double* lanes, int frames) {
  filter(cascade, lanes, frames);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(filter_high_here);
HWY_EXPORT(filter_low_here);
}  // namespace

void filter_lanes(HighCascade& cascade, double* lanes, int frames) noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(filter_high_here)(cascade, lanes, frames);
}

void filter_lanes(LowCascade& cascade, double* lanes, int frames) noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(filter_low_here)(cascade, lanes, frames);
}

}  // namespace clamor

#endif  // HWY_ONCE
