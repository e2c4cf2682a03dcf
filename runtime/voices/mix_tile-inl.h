// mix_tile-inl.h: where the voices of a tile read, step by step, for mix_kernel.cpp alone, which
// compiles it once per instruction set; hence no include guard of the usual kind.
//
// In columns, so that it becomes vector code: what a voice's place in its signal costs, a dozen
// operations on 64-bit numbers, is then small against reading and adding up.
#if defined(CLAMOR_RUNTIME_MIX_TILE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_RUNTIME_MIX_TILE_INL_H
#undef CLAMOR_RUNTIME_MIX_TILE_INL_H
#else
#define CLAMOR_RUNTIME_MIX_TILE_INL_H
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "runtime/voices/mix_kernel.h"
#include "runtime/voices/mix_read-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

// Voices whose numbers stay in L1 from one step to the next.
constexpr std::size_t kTileVoices = 64;
constexpr std::size_t kVoicesAhead = 12;  // for prefetching: some 300 cycles

// Keeps a loop over voices from being made vectors of, which would be put together lane by lane of
// what lies all over memory: that takes twice as long.
template <class Path>
HWY_INLINE void one_by_one([[maybe_unused]] Path*& paths) {
#if HWY_COMPILER_GCC || HWY_COMPILER_CLANG
  asm("" : "+r"(paths));
#endif
}

// kTwoLayers: the low layer is read as well.
template <int kDelays, bool kTwoLayers>
struct Tile {
  static constexpr int kLayers = kTwoLayers ? 2 : 1;

  std::size_t count;
  const float* gain[kTileVoices];
  const float* signal[kLayers][kDelays][kTileVoices];  // high, low
  // At the beginning of a step: VoicePath's, less 1 frame per frame.
  alignas(64) std::int64_t position[kDelays][kTileVoices];
  alignas(64) std::int64_t drift[kDelays][kTileVoices];
  alignas(64) std::int64_t bend[kDelays][kTileVoices];
  // Of the low layer.
  alignas(64) std::int64_t ahead[kDelays][kTileVoices];
  alignas(64) std::int64_t ahead_step[kDelays][kTileVoices];

  HWY_INLINE void take(const MixJob& job, const std::uint32_t* active, std::size_t voices,
                       int lanes) {
    count = voices;
    for (std::size_t v = 0; v < count; ++v) {
      const VoicePath* paths = job.paths + std::size_t{kEars} * active[v];
      one_by_one(paths);
      gain[v] = job.gains + 2 * static_cast<std::size_t>(lanes) * active[v];
      for (int e = 0; e < kDelays; ++e) {
        signal[0][e][v] = paths[e].high;
        if constexpr (kTwoLayers) signal[1][e][v] = paths[e].low;
        position[e][v] = paths[e].position;
        drift[e][v] = paths[e].step - kWhole;
        bend[e][v] = paths[e].bend;
        hwy::Prefetch(paths[e].high + (paths[e].position >> 32));  // further lines: mix_chunk()
      }
      if constexpr (kTwoLayers) {
        const LayerOffset gap = job.gaps == nullptr ? LayerOffset{} : job.gaps[active[v]];
        for (int e = 0; e < kDelays; ++e) {
          ahead[e][v] = e == 0 ? gap.ahead : -gap.ahead;
          ahead_step[e][v] = e == 0 ? gap.step : -gap.step;
        }
      }
    }
  }

  HWY_INLINE void advance() {
    for (int e = 0; e < kDelays; ++e)
      for (std::size_t v = 0; v < count; ++v) {
        position[e][v] += (drift[e][v] + kWhole) * kStepFrames;
        drift[e][v] += bend[e][v];
        if constexpr (kTwoLayers) ahead[e][v] += ahead_step[e][v] * kStepFrames;
      }
  }

  // After the last step: where the next call begins.
  HWY_INLINE void put_back(const MixJob& job, const std::uint32_t* active) const {
    const MixContinuation& to = job.next;
    for (std::size_t v = 0; v < count; ++v) {
      const std::int64_t wrap = to.wraps[active[v]];
      VoicePath* paths = to.paths + std::size_t{kEars} * active[v];
      one_by_one(paths);
      for (int e = 0; e < kDelays; ++e) {
        paths[e].position = position[e][v] - (position[e][v] >= wrap ? wrap : 0);
        paths[e].step = drift[e][v] + kWhole;
      }
      if (to.gaps != nullptr) {
        const LayerOffset& gap = job.gaps[active[v]];
        to.gaps[active[v]].ahead = gap.ahead + job.frames * gap.step;
      }
    }
  }

  // Where a layer is read: its own frames, 32.32, and how many more than one per frame.
  template <bool kLow>
  HWY_INLINE std::int64_t at(int e, std::size_t v) const {
    if constexpr (kLow) return (position[e][v] + ahead[e][v]) >> 2;
    return position[e][v];
  }
  template <bool kLow>
  HWY_INLINE std::int64_t drift_at(int e, std::size_t v) const {
    if constexpr (kLow) return drift[e][v] + ahead_step[e][v];
    return drift[e][v];
  }
};

// Sets of a tile's voices.
using VoiceSet = std::uint64_t;
static_assert(kTileVoices == 64);

// Those of which a number is not 0.
HWY_INLINE VoiceSet those_not_zero(const std::int32_t (&numbers)[kTileVoices]) {
  const hn::CappedTag<std::int32_t, 16> d;
  VoiceSet set = 0;
  for (std::size_t v = 0; v < kTileVoices; v += hn::Lanes(d)) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, hn::Ne(hn::Load(d, numbers + v), hn::Zero(d)), bits);
    VoiceSet some;
    std::memcpy(&some, bits, sizeof(some));
    set |= some << v;
  }
  return set;
}

// What is read of one layer in one step by kReads ears at once. A voice is steady if its whole
// offset to the output does not change in the step, and slides if it changes no more than once.
// Each kind is read apart, without a branch, which nobody could foretell.
template <int kReads>
struct Lines {
  VoiceSet steady, sliding, fast;
  // Not 0 if it does, and less than kStepFrames: short numbers, so that few vectors are compared.
  alignas(64) std::int32_t slides[kTileVoices];
  alignas(64) std::int32_t runs[kTileVoices];
  alignas(64) float fraction[kReads][kTileVoices];
  alignas(64) float drift[kReads][kTileVoices];
  alignas(64) float turn[kReads][kTileVoices];  // drift of a vector
  const float* x[kReads][kTileVoices + kVoicesAhead];

  template <bool kLow, int kDelays, bool kTwoLayers>
  HWY_INLINE void look(const Tile<kDelays, kTwoLayers>& tile, int first_ear) {
    constexpr int kFrames = kStepFrames / (kLow ? kLowRate : 1);
    const std::size_t count = tile.count;
    for (int r = 0; r < kReads; ++r) {
      const int e = first_ear + r;
      for (std::size_t v = 0; v < count; ++v) {
        const std::int64_t at = tile.template at<kLow>(e, v);
        const std::int64_t change = tile.template drift_at<kLow>(e, v);
        const std::int64_t bits = at & (kWhole - 1), way = (kFrames - 1) * change;
        const std::int64_t offset = (bits + way) >> 32;
        const std::int64_t far = (way + (way < 0 ? kWhole - 1 : 0)) >> 32;
        slides[v] = static_cast<std::int32_t>(r == 0 ? offset : slides[v] | offset);
        runs[v] = static_cast<std::int32_t>(r == 0 ? far : runs[v] | far);
        fraction[r][v] = static_cast<float>(static_cast<std::int32_t>(bits >> 8)) * 0x1p-24f;
        drift[r][v] = static_cast<float>(static_cast<std::int32_t>(change)) * 0x1p-32f;
        turn[r][v] = drift[r][v] * kFloats;
        x[r][v] = tile.signal[kLow][e][v] + (at >> 32);
      }
      // The first ones' next step, and, of few voices, later ones.
      for (std::size_t v = 0; v < kVoicesAhead; ++v) x[r][count + v] = x[r][v] + kFrames;
    }
    const VoiceSet all = ~VoiceSet{0} >> (kTileVoices - count);
    steady = all & ~those_not_zero(slides);
    fast = all & ~steady & those_not_zero(runs);
    sliding = all & ~steady & ~fast;
  }
};

// Calls act(v) for those of a set, in order.
template <class Act>
HWY_INLINE void for_each_of(std::uint64_t set, const Act& act) {
  for (; set != 0; set &= set - 1) act(hwy::Num0BitsBelowLS1Bit_Nonzero64(set));
}

template <bool kLow, int kDelays, bool kTwoLayers>
HWY_INLINE Reading reading_of(const Tile<kDelays, kTwoLayers>& tile, int ear, std::size_t v) {
  const std::int64_t at = tile.template at<kLow>(ear, v);
  return {tile.signal[kLow][ear][v] + (at >> 32), static_cast<std::uint32_t>(at),
          tile.template drift_at<kLow>(ear, v)};
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
