// mix_read-inl.h: interpolated reads of a voice's frames. For mix_kernel.cpp only, which compiles
// it once per instruction set; hence the unusual include guard.
#if defined(CLAMOR_RUNTIME_MIX_READ_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_RUNTIME_MIX_READ_INL_H
#undef CLAMOR_RUNTIME_MIX_READ_INL_H
#else
#define CLAMOR_RUNTIME_MIX_READ_INL_H
#endif

#include <algorithm>
#include <cstdint>

#include <hwy/highway.h>

#include "runtime/voices/mix_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, 16>;
using FloatVector = hn::Vec<FloatTag>;
constexpr int kFloats = static_cast<int>(hn::MaxLanes(FloatTag()));

// Loads a vector that is used several times. Compilers would load it again for each use, and
// unaligned loads are expensive.
HWY_INLINE FloatVector load(const float* HWY_RESTRICT x) {
  auto v = hn::LoadU(FloatTag(), x);
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
  asm("" : "+v"(v.raw));
#endif
  return v;
}

// Four neighbours of each frame, and the curve through them at the fraction f: 0 at x1, 1 at x2.
struct Taps {
  FloatVector x0, x1, x2, x3;
};

template <bool kCubic>
HWY_INLINE FloatVector curve(const Taps& t, FloatVector f) {
  const FloatTag d;
  if constexpr (!kCubic) return hn::NegMulAdd(f, hn::Sub(t.x1, t.x2), t.x1);
  // The B-spline over half its coefficients. Its polynomial in f has the coefficients (x0 + 4 x1 +
  // x2) / 3, x2 - x0, x0 - 2 x1 + x2 and (x3 - x0) / 3 + x1 - x2.
  const auto third = hn::Set(d, 1.0f / 3);
  const auto fall = hn::Sub(t.x1, t.x2);
  const auto bend = hn::Sub(hn::Sub(t.x0, t.x1), fall);
  const auto c0 = hn::MulAdd(third, bend, hn::Add(t.x1, t.x1));
  const auto c3 = hn::MulAdd(third, hn::Sub(t.x3, t.x0), fall);
  return hn::MulAdd(f, hn::MulAdd(f, hn::MulAdd(f, c3, bend), hn::Sub(t.x2, t.x0)), c0);
}

#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
// Lanes kLanes to kLanes + 15 of the 32 lanes (low, high).
template <int kLanes>
HWY_INLINE FloatVector shifted(FloatVector low, FloatVector high) {
  return FloatVector{_mm512_castsi512_ps(
      _mm512_alignr_epi32(_mm512_castps_si512(high.raw), _mm512_castps_si512(low.raw), kLanes))};
}
#endif

// A voice's read position during one step.
struct Reading {
  const float* x;          // at the integer part of the first frame's position
  std::uint32_t fraction;  // its fractional part, 2^-32 frames
  std::int64_t drift;      // 2^-32 frames per frame beyond 1
};

constexpr std::int64_t kWhole = std::int64_t{1} << 32;

// Always less than 1.
HWY_INLINE float fraction_of(std::uint32_t bits) {
  return static_cast<float>(bits >> 8) * 0x1p-24f;
}

// Up to this drift per frame, a vector's neighbours lie within two vectors.
constexpr std::int64_t kFar = (std::int64_t{1} << 32) * 3 / 10;

// Reads a vector of a voice whose integer offset changes at most once in a step. `x` is at the
// smaller of the two offsets, so positions are 0 to 2.
template <bool kCubic>
HWY_INLINE FloatVector read_gently(const float* HWY_RESTRICT x, FloatVector position) {
  const FloatTag d;
  const auto one = hn::Set(d, 1.0f);
  const auto x1 = load(x), x2 = load(x + 1), x3 = load(x + 2);
  if constexpr (!kCubic) {  // a line with one bend
    const auto f = hn::Min(position, one);
    const auto here = hn::NegMulAdd(f, hn::Sub(x1, x2), x1);
    return hn::NegMulAdd(hn::Sub(position, f), hn::Sub(x2, x3), here);
  }
  const auto next = hn::Ge(position, one);
  const auto pick = [&](FloatVector a, FloatVector b)
                        HWY_ATTR { return hn::IfThenElse(next, b, a); };
  const auto f = hn::Sub(position, hn::IfThenElseZero(next, one));
  return curve<true>(
      {pick(hn::LoadU(d, x - 1), x1), pick(x1, x2), pick(x2, x3), pick(x3, hn::LoadU(d, x + 3))},
      f);
}

// Reads one vector of frames at any drift.
template <bool kCubic>
HWY_INLINE FloatVector read_widely(const Reading& r, int frame) {
  const FloatTag d;
  const std::int64_t offset = r.fraction + frame * r.drift;
  const float* HWY_RESTRICT x = r.x + frame + (offset >> 32);
  const auto drift = hn::Set(d, static_cast<float>(r.drift) * 0x1p-32f);
  const auto fraction = hn::Set(d, fraction_of(static_cast<std::uint32_t>(offset)));
  const auto position = hn::MulAdd(hn::Iota(d, 0.0f), drift, fraction);
  // Rounds down, or at an integer to either neighbour, so that f is 0 to 1. Adding `magic` leaves
  // the integer in the last bits of the sum.
  const auto magic = hn::Set(d, 12582912.0f);
  const auto sum = hn::Add(hn::Sub(position, hn::Set(d, 0.5f)), magic);
  const auto f = hn::Sub(position, hn::Sub(sum, magic));
  const hn::RebindToSigned<FloatTag> di;
  const auto index = hn::Add(hn::BitCast(di, sum),
                             hn::Sub(hn::Iota(di, 0), hn::BitCast(di, magic)));  // of x0 from x - 1
  Taps taps{f, f, f, f};
  if (kFloats >= 4 && std::abs(r.drift) <= kFar) {
    const auto low = load(x - 1), high = load(x + kFloats - 1);
    const auto tap = [&](int k) HWY_ATTR {
      const auto at = hn::Add(index, hn::Set(di, k));
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
      return FloatVector{_mm512_permutex2var_ps(low.raw, at.raw, high.raw)};
#else
      const auto lane = hn::IndicesFromVec(d, hn::And(at, hn::Set(di, kFloats - 1)));
      return hn::IfThenElse(hn::RebindMask(d, hn::Lt(at, hn::Set(di, kFloats))),
                            hn::TableLookupLanes(low, lane), hn::TableLookupLanes(high, lane));
#endif
    };
    if (kCubic) taps = {tap(0), tap(1), tap(2), tap(3)};
    if (!kCubic) taps = {f, tap(1), tap(2), f};
  } else {
    taps.x1 = hn::GatherIndex(d, x, index);
    taps.x2 = hn::GatherIndex(d, x + 1, index);
    if (kCubic) taps.x0 = hn::GatherIndex(d, x - 1, index);
    if (kCubic) taps.x3 = hn::GatherIndex(d, x + 2, index);
  }
  return curve<kCubic>(taps, f);
}

// Reads frames `first` to first + kFrames of a step at any drift.
template <bool kCubic, int kFrames>
HWY_INLINE void read_fast(const Reading& r, int first, FloatVector (&x)[kFrames / kFloats]) {
  for (int i = 0; i < kFrames / kFloats; ++i) x[i] = read_widely<kCubic>(r, first + i * kFloats);
}

// Like read_fast(), for a voice whose integer offset changes at most once in a step of kStep
// frames.
template <bool kCubic, int kStep, int kFrames>
HWY_INLINE void read_sliding(const Reading& r, int first, FloatVector (&x)[kFrames / kFloats]) {
  const FloatTag d;
  const std::int64_t last = r.fraction + (kStep - 1) * r.drift;
  const std::int64_t before = std::min<std::int64_t>(last >> 32, 0);
  const auto slope = hn::Set(d, static_cast<float>(r.drift) * 0x1p-32f);
  const auto start = hn::Set(d, fraction_of(r.fraction) - static_cast<float>(before));
  for (int i = 0; i < kFrames / kFloats; ++i) {
    const int frame = first + i * kFloats;
    const auto at = hn::MulAdd(hn::Iota(d, static_cast<float>(frame)), slope, start);
    x[i] = read_gently<kCubic>(r.x + before + frame, at);
  }
}

// Like read_fast(), for a voice whose integer offset is constant and whose samples begin at `from`.
//
// Unaligned AVX-512 loads cost two accesses each, while shifts use ports that the arithmetic needs.
// For a linear curve, shifting one of its two neighbours takes a seventh less time with the signal
// in L1. For a cubic one, shifting one of the four helps as well; shifting two or three does not.
template <bool kCubic, int kFrames>
HWY_INLINE void read_steadily(const float* HWY_RESTRICT from, const float& fraction,
                              const float& drift, const float& turns, int first,
                              FloatVector (&x)[kFrames / kFloats]) {
  const FloatTag d;
  constexpr int kVectors = kFrames / kFloats;
  const auto slope = hn::Set(d, drift), start = hn::Set(d, fraction), turn = hn::Set(d, turns);
  const float* HWY_RESTRICT at = from + first;
  auto f = start;
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  constexpr int kBack = kCubic ? 1 : 0;
  FloatVector low = load(at - kBack);
#endif
  for (int i = 0; i < kVectors; ++i, at += kFloats) {
    // Additions are cheaper but form long dependency chains with short vectors.
    f = i % 4 == 0 ? hn::MulAdd(hn::Iota(d, static_cast<float>(first + i * kFloats)), slope, start)
                   : hn::Add(f, turn);
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
    const auto high = load(at - kBack + kFloats);
    const auto later = shifted<1 + kBack>(low, high);
    x[i] = kCubic ? curve<true>({low, load(at), later, load(at + 2)}, f)
                  : curve<false>({low, low, later, later}, f);
    low = high;
#else
    const auto x1 = load(at), x2 = load(at + 1);
    x[i] = kCubic ? curve<true>({load(at - 1), x1, x2, load(at + 2)}, f)
                  : curve<false>({x1, x1, x2, x2}, f);
#endif
  }
}

// Like read_steadily(), without drift: each neighbour has one weight.
template <bool kCubic, int kFrames>
HWY_INLINE void read_at_rest(const float* HWY_RESTRICT from, const float& fraction, int first,
                             FloatVector (&x)[kFrames / kFloats]) {
  const FloatTag d;
  const auto f = hn::Set(d, fraction), g = hn::Sub(hn::Set(d, 1.0f), f);
  const auto third = hn::Set(d, 1.0f / 3);
  const auto f2 = hn::Mul(f, f), g2 = hn::Mul(g, g);
  const auto w0 = hn::Mul(hn::Mul(third, g), g2), w3 = hn::Mul(hn::Mul(third, f), f2);
  const auto four = hn::Set(d, 4.0f / 3), two = hn::Set(d, 2.0f), three = hn::Set(d, 3.0f);
  const auto w1 = hn::MulAdd(three, w3, hn::NegMulAdd(two, f2, four));
  const auto w2 = hn::MulAdd(three, w0, hn::NegMulAdd(two, g2, four));
  const float* HWY_RESTRICT at = from + first;
  for (int i = 0; i < kFrames / kFloats; ++i, at += kFloats) {
    const auto x1 = hn::LoadU(d, at), x2 = hn::LoadU(d, at + 1);
    if constexpr (kCubic)
      x[i] = hn::Add(hn::MulAdd(w0, hn::LoadU(d, at - 1), hn::Mul(w1, x1)),
                     hn::MulAdd(w2, x2, hn::Mul(w3, hn::LoadU(d, at + 2))));
    else
      x[i] = hn::MulAdd(f, x2, hn::Mul(g, x1));
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
