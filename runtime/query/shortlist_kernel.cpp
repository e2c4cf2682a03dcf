#include "runtime/query/shortlist_kernel.h"

#include <algorithm>
#include <cstddef>

// Highway compiles what follows once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/query/shortlist_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "runtime/propagation/source_bound_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

using Integers = hn::RebindToSigned<Tag>;

// One member of as many consecutive bounds as there are lanes.
HWY_INLINE Vector gather(const float& of_first) {
  const Tag d;
  const Integers di;
  constexpr int kStride = sizeof(SourceBound) / sizeof(float);
  return hn::GatherIndex(d, &of_first, hn::Mul(hn::Iota(di, 0), hn::Set(di, kStride)));
}
HWY_INLINE Vectors gather(const Vec3f& of_first) {
  return {gather(of_first.x), gather(of_first.y), gather(of_first.z)};
}
HWY_INLINE Vector upper_bound_at(const SourceBound& first, float error_m) {
  return upper_bound_of(
      {gather(first.position_m), gather(first.normal), gather(first.mirror),
       gather(first.radius2_m2), gather(first.diffuse), gather(first.compensation),
       gather(first.lobe), gather(first.fall), gather(first.slope)},
      Vec3f(0), error_m);
}

void bound_sources(const SourceBound* sources, std::size_t count, float error_m,
                   float* upper_bounds) {
  const Tag d;
  for (std::size_t s = 0; s < count; s += hn::Lanes(d))
    hn::StoreU(upper_bound_at(sources[s], error_m), d, upper_bounds + s);
}

// Stored bounds of the visibility of some sources of a page, and their upper_bound().
struct Visibilities {
  Vector known, upper_bound;
};
HWY_INLINE Visibilities visibilities(const OcclusionUpperBounds::Window& occlusion,
                                     const std::uint32_t* source) {
  constexpr std::uint32_t kRow = OcclusionUpperBounds::kRow,
                          kPerWord = OcclusionUpperBounds::kPerWord;
  static_assert(kRow == 1 << 10 && kPerWord == 1 << 3 && OcclusionUpperBounds::kOccluded == 15);
  const Tag d;
  const hn::RebindToSigned<Tag> di;
  const hn::RebindToUnsigned<Tag> du;
  const auto index = hn::Load(du, source);
  const auto number = hn::Add(index, hn::Set(du, occlusion.first));
  const auto row = hn::BitCast(di, hn::ShiftRight<10>(number));
  const auto in_row = hn::BitCast(di, hn::ShiftRight<3>(hn::And(number, hn::Set(du, kRow - 1))));
  const auto begins = hn::IfThenElse(hn::Eq(row, hn::Zero(di)), hn::Set(di, occlusion.first_word),
                                     hn::Set(di, occlusion.next_word));
  const auto word =
      hn::BitCast(du, hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(occlusion.words),
                                      hn::Add(begins, in_row)));
  const auto shift = hn::ShiftLeft<2>(hn::And(number, hn::Set(du, kPerWord - 1)));
  const auto step = hn::BitCast(di, hn::And(hn::Shr(word, shift), hn::Set(du, 15)));
  const auto power = hn::BitCast(d, hn::ShiftLeft<23>(hn::Sub(hn::Set(di, 127), step)));
  const auto known = hn::IfThenZeroElse(hn::RebindMask(d, hn::Eq(step, hn::Set(di, 15))), power);
  const auto since = hn::Sub(number, hn::Set(du, occlusion.phase));
  const auto is_in = [&](std::uint32_t phases) {
    const auto phase = hn::BitCast(di, hn::And(since, hn::Set(du, phases - 1)));
    return hn::RebindMask(d, hn::Eq(phase, hn::Zero(di)));
  };
  const auto in_turn = hn::IfThenElse(is_in(OcclusionUpperBounds::kPhases),
                                      hn::Max(known, hn::Set(d, occlusion.phase_bound)), known);
  // A page has no more than two rows; of a third nothing is known.
  const auto none = hn::RebindMask(d, hn::Gt(row, hn::Set(di, 1)));
  const auto one = hn::Set(d, 1.0f);
  return {hn::IfThenElse(none, one, known),
          hn::IfThenElse(hn::Or(is_in(occlusion.phases), none), one, in_turn)};
}

// Loudness of one signal per lane, as shares of its maximum.
struct Shares {
  Vector share;
  hn::Vec<Integers> low, high;  // the bands' parts of it, four each
};
HWY_INLINE Shares gather_shares(const LoudnessTable& loudness, const ShortlistBlock& block,
                                std::size_t at) {
  static_assert(sizeof(BandShares) == 12 && offsetof(BandShares, parts) == 4);
  const Tag d;
  const Integers di;
  const auto last = hn::Set(d, static_cast<float>(loudness.row()) - 1);
  const auto signal = hn::Load(di, reinterpret_cast<const std::int32_t*>(&block.signal[at]));
  const auto delay = hn::MulAdd(hn::Load(d, block.delay_s.data() + at),
                                hn::Set(d, LoudnessTable::kPerS), hn::Set(d, 1.0f));
  const auto column = hn::ConvertTo(di, hn::Min(hn::Max(delay, hn::Zero(d)), last));
  const auto row = hn::Mul(signal, hn::Set(di, static_cast<std::int32_t>(loudness.row())));
  const auto word = hn::Mul(hn::Add(row, column), hn::Set(di, 3));
  const auto* const words = reinterpret_cast<const std::int32_t*>(loudness.data());
  return {hn::BitCast(d, hn::GatherIndex(di, words, word)), hn::GatherIndex(di, words + 1, word),
          hn::GatherIndex(di, words + 2, word)};
}

// BandMix::of() of the shares.
HWY_INLINE Vector weigh_bands(const BandMix* mixes, const Shares& shares) {
  static_assert(BandMix::kBits == 4 && sizeof(BandMix) == 4 && kBandCount == 8);
  const Tag d;
  const Integers di;
  const auto step_mask = hn::Set(di, std::int32_t{BandMix::kMax}), byte = hn::Set(di, 255);
  auto steps = hn::Load(di, reinterpret_cast<const std::int32_t*>(mixes));
  auto sum = hn::Zero(di);
  for (auto parts : {shares.low, shares.high})
    for (int b = 0; b < 4; ++b) {
      const auto step = hn::And(steps, step_mask);
      sum = hn::Add(sum, hn::Mul(hn::Mul(step, step), hn::And(parts, byte)));
      steps = hn::ShiftRight<4>(steps);
      parts = hn::ShiftRight<8>(parts);
    }
  constexpr float kWhole = BandMix::kMax * BandMix::kMax * BandShares::kWhole;
  return hn::Min(hn::Mul(hn::ConvertTo(d, sum), hn::Set(d, 1 / kWhole)), hn::Set(d, 1.0f));
}

void test_blocks(std::span<const ShortlistBlock> blocks, float threshold,
                 const LoudnessTable& loudness, const OcclusionUpperBounds::Window& occlusion,
                 AudibleEntries& audible) {
  const Tag d;
  const hn::RebindToUnsigned<Tag> du;
  const auto needed = hn::Set(d, threshold), one = hn::Set(d, 1.0f);
  std::size_t count = audible.count;
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (std::size_t at = 0; at < kCullBlock; at += hn::Lanes(d)) {
      const ShortlistBlock& block = blocks[b];
      const auto bound = hn::Load(d, block.upper_bound.data() + at);
      auto passes = hn::Ge(bound, needed);
      auto share = one, known = one;
      if (loudness.row() > 0 && !hn::AllFalse(d, passes)) {
        const Shares now = gather_shares(loudness, block, at);
        passes = hn::And(passes, hn::Ge(hn::Mul(bound, now.share), needed));
        if (hn::AllFalse(d, passes)) continue;
        share = hn::Mul(now.share, weigh_bands(&block.mix[at], now));
        passes = hn::And(passes, hn::Ge(hn::Mul(bound, share), needed));
      }
      if (hn::AllFalse(d, passes)) continue;
      if (occlusion.words != nullptr) {
        const Visibilities visibility = visibilities(occlusion, block.source.data() + at);
        known = visibility.known;
        const auto visible = hn::Mul(bound, hn::Mul(share, visibility.upper_bound));
        passes = hn::And(passes, hn::Ge(visible, needed));
        if (hn::AllFalse(d, passes)) continue;
      }
      const auto entry = hn::Iota(du, static_cast<std::uint32_t>(b * kCullBlock + at));
      hn::StoreU(hn::Compress(entry, hn::RebindMask(du, passes)), du, audible.entry.data() + count);
      hn::StoreU(hn::Compress(share, passes), d, audible.share.data() + count);
      hn::StoreU(hn::Compress(known, passes), d, audible.known.data() + count);
      count += hn::CountTrue(d, passes);
    }
  audible.count = count;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(test_blocks);
HWY_EXPORT(bound_sources);
// A table takes at most a quarter of a millisecond per keyframe; one that is shorter than half a
// second is of no use.
constexpr std::size_t kMaxDelays = 1 << 12, kMaxShares = 1 << 18, kMinDelays = 25;
}  // namespace

void find_audible(std::span<const ShortlistBlock> blocks, float threshold,
                  const LoudnessTable& loudness, const OcclusionUpperBounds::Window& occlusion,
                  AudibleEntries& audible) {
  HWY_DYNAMIC_DISPATCH(test_blocks)(blocks, threshold, loudness, occlusion, audible);
}

void upper_bounds_at(const SourceBound* sources, std::size_t count, float error_m,
                     float* upper_bounds) {
  HWY_DYNAMIC_DISPATCH(bound_sources)(sources, count, error_m, upper_bounds);
}

// The first and the last entry of a row are for delays out of its range.
void LoudnessTable::tabulate(std::span<const LoudnessTrack> signals, double time_s,
                             float max_delay_s, float error_s) {
  const std::size_t max_row =
      std::min(kMaxShares / std::max<std::size_t>(signals.size(), 1), kMaxDelays + 2);
  const float wanted = std::max(max_delay_s, 0.0f) * kPerS + 4;
  row_ = wanted < static_cast<float>(max_row) ? static_cast<std::size_t>(wanted) : max_row;
  if (signals.empty() || max_row < kMinDelays) row_ = 0;
  shares_.assign(signals.size() * row_, BandShares::whole());
  if (row_ == 0) return;
  for (std::size_t s = 0; s < signals.size(); ++s)
    signals[s].shares_by_delay(time_s, kPerS, static_cast<double>(error_s),
                               std::span(shares_).subspan(s * row_ + 1, row_ - 2));
}

}  // namespace clamor

#endif
