#include "runtime/mix_kernel.h"

#include <algorithm>
#include <cmath>

// Highway compiles what follows once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/mix_kernel.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, kBusLanes>;
using FloatVector = hn::Vec<FloatTag>;
constexpr int kFloats = static_cast<int>(hn::MaxLanes(FloatTag()));

// Voices whose gains and slopes are in registers at once.
constexpr int kTile = kFloats == 16 ? 8 : 4;

// Linear, less f (1 - f) times the interpolated half second difference: Catmull-Rom.
HWY_INLINE FloatVector cubic(FloatVector x0, FloatVector x1, FloatVector x2, FloatVector x3,
                             FloatVector f) {
  const FloatTag d;
  const auto rise = hn::Sub(x2, x1);
  const auto curve1 = hn::Add(hn::Sub(x0, x1), rise);  // second differences at x1 and x2
  const auto curve2 = hn::Sub(hn::Sub(x3, x2), rise);
  const auto curve = hn::MulAdd(f, hn::Sub(curve2, curve1), curve1);
  const auto half = hn::Mul(f, hn::NegMulAdd(hn::Set(d, 0.5f), f, hn::Set(d, 0.5f)));
  return hn::NegMulAdd(half, curve, hn::MulAdd(f, rise, x1));
}

HWY_INLINE FloatVector cubic_at(const float* HWY_RESTRICT x, FloatVector f) {
  const FloatTag d;
  return cubic(hn::LoadU(d, x - 1), hn::LoadU(d, x), hn::LoadU(d, x + 1), hn::LoadU(d, x + 2), f);
}

// One vector of frames whose integer offset may change on the way.
HWY_INLINE FloatVector read_sliding(const float* HWY_RESTRICT x, FloatVector position) {
  const FloatTag d;
  const hn::RebindToSigned<FloatTag> di;
  const auto whole = hn::Floor(position);
  const auto f = hn::Sub(position, whole);
  const int first = static_cast<int>(hn::GetLane(whole));
  const int last = static_cast<int>(hn::ExtractLane(whole, kFloats - 1));
  if (first == last) return cubic_at(x + first, f);
  if (std::abs(first - last) == 1)
    return hn::IfThenElse(hn::Eq(whole, hn::Set(d, static_cast<float>(first))),
                          cubic_at(x + first, f), cubic_at(x + last, f));
  const auto index = hn::Add(hn::ConvertTo(di, whole), hn::Iota(di, 0));
  return cubic(hn::GatherIndex(d, x - 1, index), hn::GatherIndex(d, x, index),
               hn::GatherIndex(d, x + 1, index), hn::GatherIndex(d, x + 2, index), f);
}

HWY_INLINE FloatVector read(const float* HWY_RESTRICT x, bool steady, FloatVector position) {
  return steady ? cubic_at(x, position) : read_sliding(x, position);
}

// The (left, right) pairs of one voice's step.
HWY_INLINE void interpolate(const KernelVoice& voice, float* HWY_RESTRICT pairs) {
  const FloatTag d;
  // Offsets that surely stay 0 throughout need no looking at; most voices' do.
  bool steady[kEars];
  for (int e = 0; e < kEars; ++e) {
    const float end = voice.fraction[e] + kStepFrames * voice.drift[e];
    steady[e] = std::min(voice.fraction[e], end) >= 0 && std::max(voice.fraction[e], end) < 0.999f;
  }
  const auto drift0 = hn::Set(d, voice.drift[0]), drift1 = hn::Set(d, voice.drift[1]);
  const auto fraction0 = hn::Set(d, voice.fraction[0]), fraction1 = hn::Set(d, voice.fraction[1]);
  auto frame = hn::Iota(d, 0.0f);
  for (int f = 0; f < kStepFrames; f += kFloats) {
    const auto left = read(voice.signal[0] + f, steady[0], hn::MulAdd(frame, drift0, fraction0));
    const auto right = read(voice.signal[1] + f, steady[1], hn::MulAdd(frame, drift1, fraction1));
    hn::StoreInterleaved2(left, right, d, pairs + kEars * f);
    frame = hn::Add(frame, hn::Set(d, static_cast<float>(kFloats)));
  }
}

// A (left, right) pair in all lanes.
HWY_INLINE FloatVector repeat_pair(const float* pair) {
  const FloatTag d;
  const hn::Repartition<std::uint64_t, FloatTag> pairs;
  std::uint64_t bits;
  hwy::CopyBytes<sizeof bits>(pair, &bits);
  return hn::BitCast(d, hn::Set(pairs, bits));
}

template <int kVoices>
HWY_INLINE void mix_tile(const KernelVoice* voices, const std::uint32_t* active, float first_frame,
                         float* HWY_RESTRICT bus) {
  const FloatTag d;
  alignas(64) float pairs[kVoices][kEars * kStepFrames];
  for (int v = 0; v < kVoices; ++v) interpolate(voices[active[v]], pairs[v]);
  for (int lane = 0; lane < kBusLanes; lane += kFloats) {
    FloatVector gain[kVoices], slope[kVoices];
    for (int v = 0; v < kVoices; ++v) {
      const KernelVoice& voice = voices[active[v]];
      slope[v] = hn::Load(d, voice.slope + lane);
      gain[v] = hn::MulAdd(hn::Set(d, first_frame), slope[v], hn::Load(d, voice.gain + lane));
    }
    for (int f = 0; f < kStepFrames; ++f) {
      float* at = bus + f * kBusLanes + lane;
      auto sum = hn::Load(d, at);
      for (int v = 0; v < kVoices; ++v) {
        sum = hn::MulAdd(repeat_pair(pairs[v] + kEars * f), gain[v], sum);
        gain[v] = hn::Add(gain[v], slope[v]);
      }
      hn::Store(sum, d, at);
    }
  }
}

void mix_voices_here(const KernelVoice* voices, const std::uint32_t* active, std::size_t count,
                     int first_frame, float* HWY_RESTRICT bus) {
  const auto frame = static_cast<float>(first_frame);
  std::size_t v = 0;
  for (; v + kTile <= count; v += kTile) {
    for (std::size_t next = v + kTile; next < std::min(v + 2 * kTile, count); ++next)
      for (int e = 0; e < kEars; ++e)
        for (int line = 0; line <= kStepFrames; line += 16)
          hwy::Prefetch(voices[active[next]].signal[e] + line);
    mix_tile<kTile>(voices, active + v, frame, bus);
  }
  for (; v < count; ++v) mix_tile<1>(voices, active + v, frame, bus);
}

void filter_lanes_here(LaneCascade& cascade, double* HWY_RESTRICT lanes, int frames) {
  const hn::CappedTag<double, 8> d;
  using Vector = hn::Vec<decltype(d)>;
  constexpr int kDoubles = static_cast<int>(hn::MaxLanes(d));
  constexpr int kTogether = kDoubles == 8 ? 4 : 2;  // sections whose memory is in registers
  static_assert(kBankSections % kTogether == 0);
  for (int first = 0; first < kBankSections; first += kTogether)
    for (int lane = 0; lane < kBusLanes; lane += kDoubles) {
      Vector b0[kTogether], b1[kTogether], b2[kTogether], a1[kTogether], a2[kTogether];
      Vector s1[kTogether], s2[kTogether];
      for (int k = 0; k < kTogether; ++k) {
        const LaneCascade::Section& section = cascade.section[first + k];
        b0[k] = hn::Load(d, section.b0 + lane);
        b1[k] = hn::Load(d, section.b1 + lane);
        b2[k] = hn::Load(d, section.b2 + lane);
        a1[k] = hn::Load(d, section.a1 + lane);
        a2[k] = hn::Load(d, section.a2 + lane);
        s1[k] = hn::Load(d, cascade.memory[first + k].s1 + lane);
        s2[k] = hn::Load(d, cascade.memory[first + k].s2 + lane);
      }
      for (int f = 0; f < frames; ++f) {
        auto x = hn::Load(d, lanes + f * kBusLanes + lane);
        for (int k = 0; k < kTogether; ++k) {
          const auto y = hn::MulAdd(b0[k], x, s1[k]);
          s1[k] = hn::NegMulAdd(a1[k], y, hn::MulAdd(b1[k], x, s2[k]));
          s2[k] = hn::NegMulAdd(a2[k], y, hn::Mul(b2[k], x));
          x = y;
        }
        hn::Store(x, d, lanes + f * kBusLanes + lane);
      }
      for (int k = 0; k < kTogether; ++k) {
        hn::Store(s1[k], d, cascade.memory[first + k].s1 + lane);
        hn::Store(s2[k], d, cascade.memory[first + k].s2 + lane);
      }
    }
}

const char* target_here() { return hwy::TargetName(HWY_TARGET); }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(mix_voices_here);
HWY_EXPORT(filter_lanes_here);
HWY_EXPORT(target_here);
}  // namespace

void mix_voices(const KernelVoice* voices, const std::uint32_t* active, std::size_t count,
                int first_frame, float* bus) noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(mix_voices_here)(voices, active, count, first_frame, bus);
}

void filter_lanes(LaneCascade& cascade, double* lanes, int frames) noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(filter_lanes_here)(cascade, lanes, frames);
}

const char* mix_kernel_target() { return HWY_DYNAMIC_DISPATCH(target_here)(); }

}  // namespace clamor

#endif  // HWY_ONCE
