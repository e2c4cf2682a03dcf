#include "runtime/mix_kernel.h"

#include <algorithm>

// Highway compiles what follows once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/mix_kernel.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "runtime/mix_read-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

// Voices whose numbers stay in L1 from one chunk of frames to the next.
constexpr std::size_t kTileVoices = 64;
constexpr std::size_t kVoicesAhead = 12;  // for prefetching: some 300 cycles

// Frames of a layer whose sums stay in registers, or, where there are too few, in L1: by the number
// of buses. None has more than kStepFrames of the full rate, so that calls may divide time
// anywhere.
constexpr int chunk_frames(int buses, bool low) {
  if (low) return kStepFrames / kLowRate;
  if (buses <= 2) return 64;
  if (buses <= kHighBands * kEars) return kFloats == 16 ? 64 : 32;
  return kFloats == 16 ? 32 : 16;
}

// Adds voices to a chunk of frames of kBands buses of kEarsHere ears, from ear `ear` on. Their
// gains begin at kFirstLane of the kLanes of a voice.
template <bool kCubic, int kDelays, int kBands, int kEarsHere, bool kLow, int kLanes,
          int kFirstLane>
HWY_INLINE void mix_chunk(const MixJob& job, const std::uint32_t* active, std::size_t count,
                          int ear, int frame, float* HWY_RESTRICT rows) {
  const FloatTag d;
  constexpr int kFrames = chunk_frames(kBands * kEarsHere, kLow), kVectors = kFrames / kFloats;
  constexpr int kRate = kLow ? kLowRate : 1;
  constexpr int kRow = kMostFrames / kRate;
  constexpr int kReads = kDelays == 1 ? 1 : kEarsHere;
  constexpr int kStride = kEars / kEarsHere;  // from bus to bus

  float* HWY_RESTRICT out = rows + ear * kRow + frame / kRate;
  FloatVector sum[kBands * kEarsHere][kVectors];
  for (int b = 0; b < kBands * kEarsHere; ++b)
    for (int i = 0; i < kVectors; ++i)
      sum[b][i] = hn::Load(d, out + b * kStride * kRow + i * kFloats);
  // In units of kGainFrames, as slopes are.
  FloatVector time[kVectors];
  for (int i = 0; i < kVectors; ++i)
    time[i] = hn::MulAdd(hn::Iota(d, static_cast<float>(i * kFloats)),
                         hn::Set(d, static_cast<float>(kRate) / kGainFrames),
                         hn::Set(d, static_cast<float>(job.first_frame + frame) / kGainFrames));

  // Copies, so that the compiler need not look whether they changed.
  const VoicePath* HWY_RESTRICT const all_paths = job.paths;
  const float* HWY_RESTRICT const all_gains = job.gains;
  const std::uint32_t* const last = job.active + job.count;
  for (std::size_t v = 0; v < count; ++v) {
    const VoicePath* paths = all_paths + std::size_t{kEars} * active[v];
    const float* gain = all_gains + std::size_t{2 * kLanes} * active[v] + kFirstLane + ear;
    const float* slope = gain + kLanes;
    if (active + v + kVoicesAhead < last) {
      const VoicePath* next = all_paths + std::size_t{kEars} * active[v + kVoicesAhead];
      for (int e = 0; e < kReads; ++e) {
        const Reading reading = reading_at<kLow>(next[kDelays == 1 ? 0 : ear + e], frame);
        for (int line = 0; line <= kFrames; line += 16) hwy::Prefetch(reading.x + line);
      }
    }
    FloatVector x[kReads][kVectors];
    for (int e = 0; e < kReads; ++e)
      read_chunk<kCubic, kFrames>(reading_at<kLow>(paths[kDelays == 1 ? 0 : ear + e], frame), x[e]);
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
  }
  for (int b = 0; b < kBands * kEarsHere; ++b)
    for (int i = 0; i < kVectors; ++i)
      hn::Store(sum[b][i], d, out + b * kStride * kRow + i * kFloats);
}

template <bool kCubic, int kDelays, int kBands, int kEarsHere, bool kLow, int kLanes,
          int kFirstLane>
HWY_INLINE void mix_layer(const MixJob& job, const std::uint32_t* active, std::size_t count,
                          float* rows) {
  constexpr int kFrames = chunk_frames(kBands * kEarsHere, kLow) * (kLow ? kLowRate : 1);
  for (int ear = 0; ear < kEars; ear += kEarsHere)
    for (int f = 0; f < job.frames; f += kFrames)
      mix_chunk<kCubic, kDelays, kBands, kEarsHere, kLow, kLanes, kFirstLane>(job, active, count,
                                                                              ear, f, rows);
}

template <bool kCubic, int kDelays, bool kEightBands>
HWY_NOINLINE void mix_here(const MixJob& job) {
  for (std::size_t first = 0; first < job.count; first += kTileVoices) {
    const std::uint32_t* active = job.active + first;
    const std::size_t count = std::min(kTileVoices, job.count - first);
    if constexpr (kEightBands) {
      mix_layer<kCubic, kDelays, kHighBands, kDelays == 1 ? 2 : 1, false, kBandLanes,
                kEars * kLowBands>(job, active, count, job.high);
      mix_layer<true, kDelays, kLowBands, 2, true, kBandLanes, 0>(job, active, count, job.low);
    } else {
      mix_layer<kCubic, kDelays, 1, 2, false, kEars, 0>(job, active, count, job.high);
    }
  }
}

// A dozen bands of one ear at a time: as many as have their sums in registers.
template <bool kCubic>
HWY_NOINLINE void mix_head_here(const MixJob& job) {
  constexpr int kDozen = 12, kDozenLanes = kEars * kDozen;
  static_assert(kHeadLowBands == kDozen && kHeadHighBands == 2 * kDozen);
  for (std::size_t first = 0; first < job.count; first += kTileVoices) {
    const std::uint32_t* active = job.active + first;
    const std::size_t count = std::min(kTileVoices, job.count - first);
    mix_layer<kCubic, 2, kDozen, 1, false, kHeadLanes, kDozenLanes>(job, active, count, job.high);
    mix_layer<kCubic, 2, kDozen, 1, false, kHeadLanes, 2 * kDozenLanes>(
        job, active, count, job.high + kDozenLanes * kMostFrames);
    mix_layer<true, 2, kDozen, 1, true, kHeadLanes, 0>(job, active, count, job.low);
  }
}

void mix_voices_here(const MixMode& mode, const MixJob& job) {
  if (mode.head)
    return mode.interpolation == Interpolation::kCubic ? mix_head_here<true>(job)
                                                       : mix_head_here<false>(job);
  const bool cubic = mode.interpolation == Interpolation::kCubic;
  if (mode.eight_bands) {
    if (mode.delays == 2)
      cubic ? mix_here<true, 2, true>(job) : mix_here<false, 2, true>(job);
    else
      cubic ? mix_here<true, 1, true>(job) : mix_here<false, 1, true>(job);
  } else {
    if (mode.delays == 2)
      cubic ? mix_here<true, 2, false>(job) : mix_here<false, 2, false>(job);
    else
      cubic ? mix_here<true, 1, false>(job) : mix_here<false, 1, false>(job);
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
