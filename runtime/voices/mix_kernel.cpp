#include "runtime/voices/mix_kernel.h"

#include <algorithm>

// Highway compiles everything below once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/voices/mix_kernel.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "runtime/voices/mix_read-inl.h"
#include "runtime/voices/mix_tile-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

// Returns how many frames of a layer are summed in registers, or in L1 if there are too few
// registers, for a number of buses. At most kStepFrames at the full rate, so that calls may divide
// time anywhere.
constexpr int chunk_frames(int buses, bool low) {
  if (low) return kStepFrames / kLowRate;
  if (buses <= kHighBands * kEars) return std::max(16, 4 * kFloats);
  return kFloats == 16 ? 32 : 16;
}

// The gains of a group of buses: they begin at lane `first` of a voice's `count`.
struct Lanes {
  int count, first;
};

// Adds voices to a chunk of frames that begins at frame `first` of a step, for kBands buses of
// kEarsHere ears from ear `ear` on.
template <bool kCubic, int kBands, int kEarsHere, bool kLow, int kDelays, bool kTwoLayers,
          int kReads>
HWY_INLINE void mix_chunk(const Tile<kDelays, kTwoLayers>& tile, const Lines<kReads>& lines,
                          const Lanes& lanes, int ear, float now, int first,
                          float* HWY_RESTRICT out) {
  const FloatTag d;
  constexpr int kFrames = chunk_frames(kBands * kEarsHere, kLow), kVectors = kFrames / kFloats;
  constexpr int kRate = kLow ? kLowRate : 1, kStep = kStepFrames / kRate;
  constexpr int kRow = kMaxFrames / kRate;
  constexpr int kStride = kEars / kEarsHere;  // between buses

  FloatVector sum[kBands * kEarsHere][kVectors];
  for (int b = 0; b < kBands * kEarsHere; ++b)
    for (int i = 0; i < kVectors; ++i)
      sum[b][i] = hn::Load(d, out + b * kStride * kRow + i * kFloats);
  // In units of kGainFrames, as the slopes are.
  FloatVector time[kVectors];
  for (int i = 0; i < kVectors; ++i)
    time[i] = hn::MulAdd(hn::Iota(d, static_cast<float>(first + i * kFloats)),
                         hn::Set(d, static_cast<float>(kRate) / kGainFrames), hn::Set(d, now));

  const auto add = [&](const float* HWY_RESTRICT gain,
                       const FloatVector(&x)[kReads][kVectors]) HWY_ATTR {
    gain += lanes.first + ear;
    const float* HWY_RESTRICT slope = gain + lanes.count;
    for (int b = 0; b < kBands * kEarsHere; ++b) {
      const int e = kReads == 1 ? 0 : b % kEarsHere;
      const auto start = hn::Set(d, gain[b * kStride]), grows = hn::Set(d, slope[b * kStride]);
      auto g = start;
      const auto more = kFloats * kRate == kGainFrames
                            ? grows
                            : hn::Mul(grows, hn::Set(d, 1.0f * kFloats * kRate / kGainFrames));
      for (int i = 0; i < kVectors; ++i) {
        g = i % 4 == 0 ? hn::MulAdd(grows, time[i], start) : hn::Add(g, more);
        sum[b][i] = hn::MulAdd(g, x[e][i], sum[b][i]);
      }
    }
  };
  FloatVector x[kReads][kVectors];
  const auto prefetch_ahead = [&](std::size_t v) HWY_ATTR {
    // The first cache line of the high layer was the last one of the previous chunk, or take() has
    // prefetched it.
    for (int r = 0; r < kReads; ++r)
      for (int line = kLow ? 0 : 16; line <= kFrames; line += 16)
        hwy::Prefetch(lines.x[r][v + kVoicesAhead] + first + line);
  };
  for_each_of(lines.resting, [&](std::size_t v) HWY_ATTR {
    prefetch_ahead(v);
    for (int r = 0; r < kReads; ++r)
      read_at_rest<kCubic, kFrames>(lines.x[r][v], lines.fraction[r][v], first, x[r]);
    const float* HWY_RESTRICT gain = tile.gain[v] + lanes.first + ear;
    for (int b = 0; b < kBands * kEarsHere; ++b) {
      const int e = kReads == 1 ? 0 : b % kEarsHere;
      const auto g = hn::Set(d, gain[b * kStride]);
      for (int i = 0; i < kVectors; ++i) sum[b][i] = hn::MulAdd(g, x[e][i], sum[b][i]);
    }
  });
  for_each_of(lines.steady, [&](std::size_t v) HWY_ATTR {
    prefetch_ahead(v);
    for (int r = 0; r < kReads; ++r)
      read_steadily<kCubic, kFrames>(lines.x[r][v], lines.fraction[r][v], lines.drift[r][v],
                                     lines.turn[r][v], first, x[r]);
    add(tile.gain[v], x);
  });
  const auto reading = [&](int r, std::size_t v) HWY_ATTR {
    return reading_of<kLow>(tile, kDelays == 1 ? 0 : ear + r, v);
  };
  for_each_of(lines.sliding, [&](std::size_t v) HWY_ATTR {
    for (int r = 0; r < kReads; ++r)
      read_sliding<kCubic, kStep, kFrames>(reading(r, v), first, x[r]);
    add(tile.gain[v], x);
  });
  for_each_of(lines.fast, [&](std::size_t v) HWY_ATTR {
    for (int r = 0; r < kReads; ++r) read_fast<kCubic, kFrames>(reading(r, v), first, x[r]);
    add(tile.gain[v], x);
  });
  for (int b = 0; b < kBands * kEarsHere; ++b)
    for (int i = 0; i < kVectors; ++i)
      hn::Store(sum[b][i], d, out + b * kStride * kRow + i * kFloats);
}

// Adds one step of the tile's voices to `rows`, which begin at the first frame of the call. Its
// loops are long code, which takes seconds to compile, so its callers share it.
template <bool kCubic, int kBands, int kEarsHere, bool kLow, int kDelays, bool kTwoLayers,
          int kReads>
HWY_NOINLINE void mix_step(const Tile<kDelays, kTwoLayers>& tile, const Lines<kReads>& lines,
                           const Lanes& lanes, int ear, const MixJob& job, int step, float* rows) {
  constexpr int kRate = kLow ? kLowRate : 1, kStep = kStepFrames / kRate;
  constexpr int kFrames = std::min(kStep, chunk_frames(kBands * kEarsHere, kLow));
  const float now = static_cast<float>(job.first_frame + step) / kGainFrames;
  for (int f = 0; f < kStep; f += kFrames)
    mix_chunk<kCubic, kBands, kEarsHere, kLow>(tile, lines, lanes, ear, now, f,
                                               rows + (ear * kMaxFrames + step) / kRate + f);
}

// Calls mix(tile, step) for all tiles and steps.
template <int kDelays, bool kTwoLayers, class Mix>
HWY_INLINE void for_steps(const MixJob& job, int lanes, const Mix& mix) {
  Tile<kDelays, kTwoLayers> tile;
  for (std::size_t first = 0; first < job.count; first += kTileVoices) {
    tile.take(job, job.active + first, std::min(kTileVoices, job.count - first), lanes);
    for (int step = 0; step < job.frames; step += kStepFrames) {
      mix(tile, step);
      tile.advance();
    }
    if (job.next.paths != nullptr) tile.put_back(job, job.active + first);
  }
}

template <bool kCubic, int kDelays>
HWY_NOINLINE void mix_full_here(const MixJob& job) {
  Lines<kDelays> lines;
  for_steps<kDelays, false>(job, kEars, [&](const Tile<kDelays, false>& tile, int step) HWY_ATTR {
    lines.template look<false>(tile, 0);
    mix_step<kCubic, 1, 2, false>(tile, lines, {kEars, 0}, 0, job, step, job.high);
  });
}

template <bool kCubic, int kDelays>
HWY_NOINLINE void mix_bands_here(const MixJob& job) {
  constexpr int kEarsHere = kDelays == 1 ? 2 : 1;
  Lines<1> high;
  Lines<kDelays> low;
  for_steps<kDelays, true>(
      job, kBandLanes, [&](const Tile<kDelays, true>& tile, int step) HWY_ATTR {
        for (int ear = 0; ear < kEars; ear += kEarsHere) {
          high.template look<false>(tile, ear);
          mix_step<kCubic, kHighBands, kEarsHere, false>(
              tile, high, {kBandLanes, kEars * kLowBands}, ear, job, step, job.high);
        }
        low.template look<true>(tile, 0);
        mix_step<true, kLowBands, 2, true>(tile, low, {kBandLanes, 0}, 0, job, step, job.low);
      });
}

// Twelve bands of one ear at a time, as many as can be summed in registers.
template <bool kCubic>
HWY_NOINLINE void mix_head_here(const MixJob& job) {
  constexpr int kDozen = 12, kDozenLanes = kEars * kDozen;
  constexpr int kLowRow = kMaxFrames / kLowRate;
  static_assert(kHrtfLowBands == kDozen && kHrtfHighBands == 2 * kDozen);
  Lines<1> lines;
  for_steps<2, true>(job, kHrtfLanes, [&](const Tile<2, true>& tile, int step) HWY_ATTR {
    for (int ear = 0; ear < kEars; ++ear) {
      lines.look<false>(tile, ear);
      mix_step<kCubic, kDozen, 1, false>(tile, lines, {kHrtfLanes, kDozenLanes}, ear, job, step,
                                         job.high);
      mix_step<kCubic, kDozen, 1, false>(tile, lines, {kHrtfLanes, 2 * kDozenLanes}, ear, job, step,
                                         job.high + kDozenLanes * kMaxFrames);
      lines.look<true>(tile, ear);
      mix_step<true, kDozen, 1, true>(tile, lines, {kHrtfLanes, 0}, ear, job, step, job.low);
      mix_step<true, static_cast<int>(kHrtfQuadratures), 1, true>(
          tile, lines, {kHrtfLanes, 3 * kDozenLanes}, ear, job, step,
          job.low + kDozenLanes * kLowRow);
    }
  });
}

void mix_voices_here(const MixMode& mode, const MixJob& job) {
  if (mode.head)
    return mode.interpolation == Interpolation::kCubic ? mix_head_here<true>(job)
                                                       : mix_head_here<false>(job);
  const bool cubic = mode.interpolation == Interpolation::kCubic;
  if (mode.eight_bands) {
    if (mode.delays == 2)
      cubic ? mix_bands_here<true, 2>(job) : mix_bands_here<false, 2>(job);
    else
      cubic ? mix_bands_here<true, 1>(job) : mix_bands_here<false, 1>(job);
  } else {
    if (mode.delays == 2)
      cubic ? mix_full_here<true, 2>(job) : mix_full_here<false, 2>(job);
    else
      cubic ? mix_full_here<true, 1>(job) : mix_full_here<false, 1>(job);
  }
}

std::int64_t target_here() { return HWY_TARGET; }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(mix_voices_here);
HWY_EXPORT(target_here);
}  // namespace

void mix_voices(const MixMode& mode, const MixJob& job) noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(mix_voices_here)(mode, job);
}

std::string mix_kernel_target() { return hwy::TargetName(HWY_DYNAMIC_DISPATCH(target_here)()); }

std::vector<std::string> mix_kernel_targets() {
  std::vector<std::string> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets())
    names.emplace_back(hwy::TargetName(target));
  return names;
}

void force_mix_kernel(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets())
    if (name == hwy::TargetName(target)) {
      hwy::SetSupportedTargetsForTest(target);
      break;
    }
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace clamor

#endif  // HWY_ONCE
