#include "runtime/voices/gain_ramp_kernel.h"

// Highway compiles everything below once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/voices/gain_ramp_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, kBandLanes>;
using Vector = hn::Vec<Tag>;

// An octave's gains of both ears, interleaved, from lane `at` on.
HWY_INLINE Vector by_turns(const std::array<Bands, kEars>& gain, std::size_t octave,
                           [[maybe_unused]] std::size_t at) {
  const Tag d;
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(d, gain[at % kEars][octave]);
#else
  return hn::OddEven(hn::Set(d, gain[1][octave]), hn::Set(d, gain[0][octave]));
#endif
}

void bus_lanes_here(const BusGains& buses, const std::array<Bands, kEars>& gain,
                    float* HWY_RESTRICT lanes) {
  const Tag d;
  for (std::size_t at = 0; at < kBandLanes; at += hn::Lanes(d)) {
    auto sum = hn::Zero(d);
    for (std::size_t c = 0; c < kBandCount; ++c)
      sum = hn::MulAdd(hn::Load(d, buses.columns[c].data() + at), by_turns(gain, c, at), sum);
    hn::StoreU(sum, d, lanes + at);
  }
}

// For lane counts that are a multiple of the vector size.
template <std::size_t kMost>
HWY_INLINE bool ramp_in_vectors(const GainRamps& lines) {
  const hn::CappedTag<float, kMost> d;
  const float per_frame = static_cast<float>(kGainFrames) / static_cast<float>(lines.frames);
  const auto over = hn::Set(d, per_frame);
  auto loudest = hn::Zero(d);
  for (std::size_t at = 0; at < lines.lanes; at += hn::Lanes(d)) {
    const auto from = lines.starts ? hn::Zero(d) : hn::LoadU(d, lines.target + at);
    const auto to = hn::LoadU(d, lines.targets + at);
    hn::StoreU(from, d, lines.gain + at);
    hn::StoreU(hn::Mul(hn::Sub(to, from), over), d, lines.gain + lines.lanes + at);
    hn::StoreU(to, d, lines.target + at);
    loudest = hn::Max(loudest, hn::Max(hn::Abs(from), hn::Abs(to)));
  }
  return !hn::AllTrue(d, hn::Eq(loudest, hn::Zero(d)));
}

bool ramp_gains_here(const GainRamps& lines) {
  static_assert(kBandLanes % 16 == 0 && kHrtfLanes % 4 == 0 && kEars == 2);
  if (lines.lanes % 16 == 0) return ramp_in_vectors<16>(lines);
  return ramp_in_vectors<4>(lines);
}

HWY_INLINE void colour(const std::array<HrtfCorner, 3>& corners,
                       const std::array<Bands, kEars>& gain, const Bands& mean_square,
                       std::array<Bands, kEars>& coloured) {
  static_assert(kBandCount == 8, "rows of bands fill whole vectors");
  const hn::CappedTag<float, kBandCount> d;
  for (std::size_t e = 0; e < kEars; ++e)
    for (std::size_t b = 0; b < kBandCount; b += hn::Lanes(d)) {
      const auto own = hn::LoadU(d, gain[e].data() + b);
      const auto power = hn::Mul(hn::Mul(own, own), hn::LoadU(d, mean_square.data() + b));
      auto level = hn::Zero(d);
      for (const HrtfCorner& corner : corners) {
        const auto share = hn::Set(d, corner.share);
        float* const sum = (*corner.power)[e].data() + b;
        level = hn::MulAdd(share, hn::LoadU(d, (*corner.level)[e].data() + b), level);
        hn::StoreU(hn::MulAdd(share, power, hn::LoadU(d, sum)), d, sum);
      }
      hn::StoreU(hn::Mul(own, level), d, coloured[e].data() + b);
    }
}

void hrtf_gains_here(const std::array<HrtfCorner, 3>& corners, const std::array<Bands, kEars>& gain,
                     const Bands& mean_square, std::array<Bands, kEars>& coloured) {
  colour(corners, gain, mean_square, coloured);
}

bool ramp_hrtf_gains_here(const BusGains& buses, const std::array<HrtfCorner, 3>& corners,
                          const std::array<Bands, kEars>& gain, const Bands& mean_square,
                          GainRamps lines) {
  std::array<Bands, kEars> coloured;
  colour(corners, gain, mean_square, coloured);
  alignas(64) float targets[kBandLanes];
  bus_lanes_here(buses, coloured, targets);
  lines.targets = targets;
  return ramp_in_vectors<16>(lines);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(bus_lanes_here);
HWY_EXPORT(hrtf_gains_here);
HWY_EXPORT(ramp_gains_here);
HWY_EXPORT(ramp_hrtf_gains_here);

// Scalar: two lanes are less than a vector, and dispatching would take as long as the work.
bool slide_ears(const GainRamps& lines) noexcept REALTIME {
  const float per_frame = static_cast<float>(kGainFrames) / static_cast<float>(lines.frames);
  bool audible = false;
  for (std::size_t e = 0; e < kEars; ++e) {
    const float from = lines.starts ? 0 : lines.target[e], to = lines.targets[e];
    lines.gain[e] = from;
    lines.gain[kEars + e] = (to - from) * per_frame;
    lines.target[e] = to;
    audible |= from != 0 || to != 0;
  }
  return audible;
}
}  // namespace

BusGains BusGains::of(const Matrix& matrix) {
  BusGains gains;
  for (std::size_t b = 0; b < kBandCount; ++b)
    for (std::size_t c = 0; c < kBandCount; ++c)
      for (int ear = 0; ear < kEars; ++ear)
        gains.columns[c][static_cast<std::size_t>(band_lane(b, ear))] =
            static_cast<float>(matrix[b][c]);
  return gains;
}

void bus_lanes(const BusGains& buses, const std::array<Bands, kEars>& gain,
               float* lanes) noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(bus_lanes_here)(buses, gain, lanes);
}

void hrtf_gains(const std::array<HrtfCorner, 3>& corners, const std::array<Bands, kEars>& gain,
                const Bands& mean_square, std::array<Bands, kEars>& coloured) noexcept REALTIME {
  HWY_DYNAMIC_DISPATCH(hrtf_gains_here)(corners, gain, mean_square, coloured);
}

bool ramp_gains(const GainRamps& lines) noexcept REALTIME {
  if (lines.lanes == kEars) return slide_ears(lines);
  return HWY_DYNAMIC_DISPATCH(ramp_gains_here)(lines);
}

bool ramp_hrtf_gains(const BusGains& buses, const std::array<HrtfCorner, 3>& corners,
                     const std::array<Bands, kEars>& gain, const Bands& mean_square,
                     const GainRamps& lines) noexcept REALTIME {
  return HWY_DYNAMIC_DISPATCH(ramp_hrtf_gains_here)(buses, corners, gain, mean_square, lines);
}

}  // namespace clamor

#endif
