// mix_tile-inl.h: read positions of a tile of voices, step by step. For mix_kernel.cpp only, which
// compiles it once per instruction set; hence the unusual include guard.
//
// Positions take a dozen 64-bit operations per voice. They are stored in columns so that this
// becomes vector code, which makes their cost small against reading and adding.
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

// Voices whose positions stay in L1 from one step to the next.
constexpr std::size_t kTileVoices = 64;
constexpr std::size_t kVoicesAhead = 12;  // prefetch distance, some 300 cycles

// Keeps the compiler from vectorising a loop over voices. It would gather the elements from all
// over memory, which takes twice as long.
template <class Path>
HWY_INLINE void one_by_one([[maybe_unused]] Path*& paths) {
#if HWY_COMPILER_GCC || HWY_COMPILER_CLANG
  asm("" : "+r"(paths));
#endif
}

// A set of a tile's voices.
using VoiceSet = std::uint64_t;
static_assert(kTileVoices == 64);

// The voices whose number is not 0.
template <class T>
HWY_INLINE VoiceSet those_not_zero(const T (&numbers)[kTileVoices]) {
  const hn::CappedTag<T, 16> d;
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

HWY_INLINE bool any_not_zero(const float* HWY_RESTRICT numbers, int count) {
  std::uint32_t bits = 0;
  for (int i = 0; i < count; ++i) {
    std::uint32_t number;
    std::memcpy(&number, numbers + i, sizeof(number));
    bits |= number << 1;  // without the sign of -0
  }
  return bits != 0;
}

// With kTwoLayers the low layer is read as well.
template <int kDelays, bool kTwoLayers>
struct Tile {
  static constexpr int kLayers = kTwoLayers ? 2 : 1;

  std::size_t count;
  VoiceSet ramped;  // the voices whose gains change
  const float* gain[kTileVoices];
  const float* signal[kLayers][kDelays][kTileVoices];  // high, low
  // At the beginning of a step, as in VoicePath; the drift is the step less 1.
  alignas(64) std::int64_t position[kDelays][kTileVoices];
  alignas(64) std::int64_t drift[kDelays][kTileVoices];
  alignas(64) std::int64_t bend[kDelays][kTileVoices];
  // The low layer's offset and its change per frame.
  alignas(64) std::int64_t ahead[kDelays][kTileVoices];
  alignas(64) std::int64_t ahead_step[kDelays][kTileVoices];

  HWY_INLINE void take(const MixJob& job, const std::uint32_t* active, std::size_t voices,
                       int lanes) {
    count = voices;
    ramped = 0;
    for (std::size_t v = 0; v < count; ++v) {
      const VoicePath* paths = job.paths + std::size_t{kEars} * active[v];
      one_by_one(paths);
      gain[v] = job.gains + 2 * static_cast<std::size_t>(lanes) * active[v];
      ramped |= VoiceSet{any_not_zero(gain[v] + lanes, lanes)} << v;
      for (int e = 0; e < kDelays; ++e) {
        signal[0][e][v] = paths[e].high;
        if constexpr (kTwoLayers) signal[1][e][v] = paths[e].low;
        position[e][v] = paths[e].position;
        drift[e][v] = paths[e].step - kWhole;
        bend[e][v] = paths[e].bend;
        // mix_chunk() prefetches further lines.
        hwy::Prefetch(paths[e].high + (paths[e].position >> 32));
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

  // Writes the positions for the next call, after the last step.
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

  // Read position in a layer, in its own 32.32 frames, and the drift per frame beyond 1.
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

// Reads of one layer in one step for kReads ears at once. A voice is steady if its integer offset
// to the output is constant in the step, and slides if the offset changes at most once. A steady one
// rests if its fractions and gains are constant as well. Each kind is read in its own loop, since a
// branch per voice would be unpredictable.
template <int kReads>
struct Lines {
  VoiceSet resting, steady, sliding, fast;
  // The slide is 0 for a steady delay and less than kStepFrames. Narrow integers keep the
  // comparisons to few vectors.
  alignas(64) std::int32_t slides[kTileVoices];
  alignas(64) std::int32_t runs[kTileVoices];
  alignas(64) float fraction[kReads][kTileVoices];
  alignas(64) float drift[kReads][kTileVoices];
  alignas(64) float turn[kReads][kTileVoices];  // drift per vector
  const float* x[kReads][kTileVoices + kVoicesAhead];

  template <bool kLow, int kDelays, bool kTwoLayers>
  HWY_INLINE void look(const Tile<kDelays, kTwoLayers>& tile, int first_ear) {
    constexpr int kFrames = kStepFrames / (kLow ? kLowRate : 1);
    const std::size_t count = tile.count;
    VoiceSet moving = tile.ramped;
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
      moving |= those_not_zero(drift[r]);
      // Prefetch addresses: the next step of the first voices and, of few voices, later steps.
      for (std::size_t v = 0; v < kVoicesAhead; ++v) x[r][count + v] = x[r][v] + kFrames;
    }
    const VoiceSet all = ~VoiceSet{0} >> (kTileVoices - count);
    const VoiceSet constant = all & ~those_not_zero(slides);
    resting = constant & ~moving;
    steady = constant & moving;
    fast = all & ~constant & those_not_zero(runs);
    sliding = all & ~constant & ~fast;
  }
};

// Calls act(v) for the members of a set, in ascending order.
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
