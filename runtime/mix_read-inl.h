// mix_read-inl.h: how a voice's frames are read, for mix_kernel.cpp alone, which compiles it once
// per instruction set; hence no include guard of the usual kind.
#if defined(CLAMOR_RUNTIME_MIX_READ_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_RUNTIME_MIX_READ_INL_H
#undef CLAMOR_RUNTIME_MIX_READ_INL_H
#else
#define CLAMOR_RUNTIME_MIX_READ_INL_H
#endif

#include <algorithm>
#include <cstdint>

#include <hwy/highway.h>

#include "runtime/mix_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, 16>;
using FloatVector = hn::Vec<FloatTag>;
constexpr int kFloats = static_cast<int>(hn::MaxLanes(FloatTag()));

// Four neighbours of each frame, and how a curve is drawn through them: f is 0 at x1, 1 at x2.
struct Taps {
  FloatVector x0, x1, x2, x3;
};

template <bool kCubic>
HWY_INLINE FloatVector curve(const Taps& t, FloatVector f) {
  const FloatTag d;
  // Each neighbour is named once: compilers load it anew for each time, and unaligned loads are
  // dear.
  if constexpr (!kCubic) return hn::NegMulAdd(f, hn::Sub(t.x1, t.x2), t.x1);
  // The B-spline over samples that are half its coefficients, its powers of f
  // (x0 + 4 x1 + x2) / 3, x2 - x0, x0 - 2 x1 + x2 and (x3 - x0) / 3 + x1 - x2.
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

// Between x[0] and x[1], a fraction f of the way.
template <bool kCubic>
HWY_INLINE FloatVector between(const float* HWY_RESTRICT x, FloatVector f) {
  const FloatTag d;
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  // Whole vectors that are not aligned cost two accesses each, and the next frames' low is this
  // high; but shifting all the others takes ports from the arithmetic: one of each is best.
  if constexpr (kCubic) {
    const auto low = hn::LoadU(d, x - 1), high = hn::LoadU(d, x + kFloats - 1);
    return curve<true>({low, hn::LoadU(d, x), shifted<2>(low, high), hn::LoadU(d, x + 2)}, f);
  }
#endif
  const auto x1 = hn::LoadU(d, x), x2 = hn::LoadU(d, x + 1);
  if constexpr (!kCubic) return curve<false>({x1, x1, x2, x2}, f);
  return curve<true>({hn::LoadU(d, x - 1), x1, x2, hn::LoadU(d, x + 2)}, f);
}

// Where a voice reads during one chunk.
struct Reading {
  const float* x;          // whole part of the first frame's position
  std::uint32_t fraction;  // the rest of it, 2^-32 frames
  std::int64_t drift;      // 2^-32 frames per frame beyond 1
};

// Always less than 1.
HWY_INLINE float fraction_of(std::uint32_t bits) {
  return static_cast<float>(bits >> 8) * 0x1p-24f;
}

template <bool kLow>
HWY_INLINE Reading reading_at(const VoicePath& path, int frame) {
  std::int64_t position = path.position_at(frame);
  if constexpr (kLow) position >>= 2;
  return {(kLow ? path.low : path.high) + (position >> 32), static_cast<std::uint32_t>(position),
          path.step_at(frame) - (std::int64_t{1} << 32)};
}

// True if the whole offset between voice and output is the same for all frames of the chunk.
template <int kFrames>
HWY_INLINE bool is_steady(const Reading& r) {
  return ((r.fraction + (kFrames - 1) * r.drift) >> 32) == 0;
}

// How far a voice slides, per frame: hardly, so that a vector has at most two whole offsets; so far
// that its neighbours are within two vectors; or farther.
constexpr std::int64_t kHardly = (std::int64_t{1} << 32) / 16;
constexpr std::int64_t kFar = (std::int64_t{1} << 32) * 3 / 10;

// One vector of frames whose integer offset may change on the way.
template <bool kCubic>
HWY_INLINE FloatVector read_sliding(const Reading& r, int frame) {
  const FloatTag d;
  const std::int64_t offset = r.fraction + frame * r.drift;
  const float* HWY_RESTRICT x = r.x + frame + (offset >> 32);
  const auto drift = hn::Set(d, static_cast<float>(r.drift) * 0x1p-32f);
  const auto fraction = hn::Set(d, fraction_of(static_cast<std::uint32_t>(offset)));
  const auto position = hn::MulAdd(hn::Iota(d, 0.0f), drift, fraction);
  const std::int64_t distance = std::abs(r.drift);
  if (distance <= kHardly) {
    // From the lesser of its two whole offsets, which is its first or its last frame's.
    const std::int64_t last = offset + (kFloats - 1) * r.drift;
    const float* HWY_RESTRICT y = r.x + frame + (std::min(offset, last) >> 32);
    const auto one = hn::Set(d, 1.0f);
    const auto at = y == x ? position : hn::Add(position, one);
    const auto next = hn::Ge(at, one);
    const auto pick = [&](FloatVector a, FloatVector b)
                          HWY_ATTR { return hn::IfThenElse(next, b, a); };
    const auto x1 = hn::LoadU(d, y), x2 = hn::LoadU(d, y + 1), x3 = hn::LoadU(d, y + 2);
    const auto g = hn::Sub(at, hn::IfThenElseZero(next, one));
    Taps taps{g, pick(x1, x2), pick(x2, x3), g};
    if constexpr (kCubic) {
      taps.x0 = pick(hn::LoadU(d, y - 1), x1);
      taps.x3 = pick(x3, hn::LoadU(d, y + 3));
    }
    return curve<kCubic>(taps, g);
  }
  const auto whole = hn::Floor(position);
  const auto f = hn::Sub(position, whole);
  const hn::RebindToSigned<FloatTag> di;
  const auto index = hn::Add(hn::ConvertTo(di, whole), hn::Iota(di, 0));  // of x0 from x - 1
  Taps taps{f, f, f, f};
  if (kFloats >= 4 && distance <= kFar) {
    const auto low = hn::LoadU(d, x - 1), high = hn::LoadU(d, x + kFloats - 1);
    const auto tap = [&](int k) HWY_ATTR {
      const auto at = hn::Add(index, hn::Set(di, k));
      const auto lane = hn::IndicesFromVec(d, hn::And(at, hn::Set(di, kFloats - 1)));
      return hn::IfThenElse(hn::RebindMask(d, hn::Lt(at, hn::Set(di, kFloats))),
                            hn::TableLookupLanes(low, lane), hn::TableLookupLanes(high, lane));
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

template <bool kCubic, int kFrames>
HWY_NOINLINE void slide(const Reading& r, float* HWY_RESTRICT out) {
  const FloatTag d;
  for (int f = 0; f < kFrames; f += kFloats) hn::Store(read_sliding<kCubic>(r, f), d, out + f);
}

template <bool kCubic, int kFrames>
HWY_INLINE void read_chunk(const Reading& r, FloatVector (&x)[kFrames / kFloats]) {
  const FloatTag d;
  constexpr int kVectors = kFrames / kFloats;
  if (HWY_LIKELY(is_steady<kFrames>(r))) {
    const float drift = static_cast<float>(static_cast<std::int32_t>(r.drift)) * 0x1p-32f;
    const auto slope = hn::Set(d, drift);
    const auto start = hn::Set(d, fraction_of(r.fraction));
    const auto turn = hn::Set(d, drift * kFloats);
    auto f = start;
    for (int i = 0; i < kVectors; ++i) {
      // Additions are cheaper, but short vectors would make too many of them in a row.
      f = i % 4 == 0 ? hn::MulAdd(hn::Iota(d, static_cast<float>(i * kFloats)), slope, start)
                     : hn::Add(f, turn);
      x[i] = between<kCubic>(r.x + i * kFloats, f);
    }
  } else {
    HWY_ALIGN float slid[kFrames];
    slide<kCubic, kFrames>(r, slid);
    for (int i = 0; i < kVectors; ++i) x[i] = hn::Load(d, slid + i * kFloats);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
