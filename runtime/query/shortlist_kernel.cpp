#include "runtime/query/shortlist_kernel.h"

#include <algorithm>
#include <cstddef>

// Highway compiles what follows once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/query/shortlist_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "runtime/query/culler_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

constexpr float kRounding = 4e-6f;         // a few operations in single precision
constexpr float kSlack = 1.0005f;          // the exponential, and sums
constexpr float kMinDistance2_m2 = 1e-8f;  // nearer, the direction is unknown
constexpr float kSine2Rounding = 1e-5f;    // of a squared sine
constexpr float kMinDistancePerError = 4;

using Integers = hn::RebindToSigned<Tag>;

// One member of as many consecutive shapes as there are lanes.
HWY_INLINE Vector gather(const float& of_first) {
  const Tag d;
  const hn::RebindToSigned<Tag> di;
  constexpr int kStride = sizeof(SourceShape) / sizeof(float);
  return hn::GatherIndex(d, &of_first, hn::Mul(hn::Iota(di, 0), hn::Set(di, kStride)));
}
HWY_INLINE Vectors gather(const Vec3f& of_first) {
  return {gather(of_first.x), gather(of_first.y), gather(of_first.z)};
}

HWY_INLINE Vector upper_bound_of(const SourceShape& first, float error_m) {
  const Tag d;
  const auto one = hn::Set(d, 1.0f), zero = hn::Zero(d), off = hn::Set(d, error_m);
  const Vectors position = gather(first.position_m);
  const Vectors way = {hn::Neg(position.x), hn::Neg(position.y), hn::Neg(position.z)};
  const auto r2 = dot(way, way);
  const auto on_it2 = hn::Set(
      d,
      std::max(kMinDistance2_m2, kMinDistancePerError * kMinDistancePerError * error_m * error_m));
  const auto on_it = hn::Lt(r2, on_it2);
  const auto over_r = hn::Div(one, hn::Sqrt(hn::Max(r2, on_it2)));
  const auto near = hn::Sub(hn::Mul(hn::Sqrt(r2), hn::Set(d, 1 - kRounding)), off);
  const auto near2 = hn::Max(hn::Mul(hn::Max(near, zero), near), gather(first.radius2_m2));
  // An error of the position turns the direction by asin(error / r).
  const auto sin_off = hn::Mul(off, over_r), rounds = hn::Set(d, kRounding);
  const auto cos_off = hn::Sqrt(hn::NegMulAdd(sin_off, sin_off, one));
  const auto highest = [&](Vector cos) {
    const auto sin2 = hn::Max(hn::NegMulAdd(cos, cos, one), zero);
    const auto sin = hn::Sqrt(hn::Add(sin2, hn::Set(d, kSine2Rounding)));
    const auto turned = hn::MulAdd(cos, cos_off, hn::MulAdd(sin, sin_off, rounds));
    return hn::IfThenElse(hn::Lt(cos, cos_off), hn::Min(turned, one), one);
  };
  const Vectors normal = gather(first.normal), mirror = gather(first.mirror);
  const auto slope = gather(first.slope);
  const auto is_emitter = hn::Lt(slope, zero);
  const auto cos_n = highest(hn::Mul(dot(way, normal), over_r));
  const auto cos_o = hn::IfThenElse(hn::Or(is_emitter, on_it), one, hn::Max(cos_n, zero));
  const auto cos_m = highest(hn::Mul(dot(way, mirror), over_r));
  const auto cos_a = hn::IfThenElse(on_it, one, cos_m);
  const auto tilt = tilt_of(d, cos_o, normal, mirror, is_emitter);
  const auto left = decay(d, hn::Mul(gather(first.fall), hn::Sub(one, cos_a)));
  const auto lobe = hn::Mul(hn::Mul(gather(first.lobe), tilt), left);
  const auto bounce = bounce_up_to(d, cos_o, gather(first.bounce), slope);
  const auto most = hn::MulAdd(gather(first.diffuse), cos_o, hn::Add(bounce, lobe));
  return hn::Div(hn::Mul(hn::Set(d, kSlack), most), near2);
}

void upper_bounds_of_all(std::span<const SourceShape> shapes, float error_m, float* upper_bounds) {
  const Tag d;
  std::size_t s = 0;
  for (; s + hn::Lanes(d) <= shapes.size(); s += hn::Lanes(d))
    hn::StoreU(upper_bound_of(shapes[s], error_m), d, upper_bounds + s);
  if (s == shapes.size()) return;
  std::array<SourceShape, kCullBlock> last;
  std::copy(shapes.begin() + static_cast<std::ptrdiff_t>(s), shapes.end(), last.begin());
  HWY_ALIGN float some[kCullBlock];
  hn::Store(upper_bound_of(last[0], error_m), d, some);
  std::copy(some, some + (shapes.size() - s), upper_bounds + s);
}

// Stored bounds of the visibility of some sources of a page, and their upper_bound().
struct Left {
  Vector known, most;
};
HWY_INLINE Left left_of(const OcclusionUpperBounds::Window& hidden, const std::uint32_t* source) {
  constexpr std::uint32_t kRow = OcclusionUpperBounds::kRow,
                          kPerWord = OcclusionUpperBounds::kPerWord;
  static_assert(kRow == 1 << 10 && kPerWord == 1 << 3 && OcclusionUpperBounds::kOccluded == 15);
  const Tag d;
  const hn::RebindToSigned<Tag> di;
  const hn::RebindToUnsigned<Tag> du;
  const auto index = hn::Load(du, source);
  const auto number = hn::Add(index, hn::Set(du, hidden.first));
  const auto row = hn::BitCast(di, hn::ShiftRight<10>(number));
  const auto in_row = hn::BitCast(di, hn::ShiftRight<3>(hn::And(number, hn::Set(du, kRow - 1))));
  const auto begins = hn::IfThenElse(hn::Eq(row, hn::Zero(di)), hn::Set(di, hidden.first_word),
                                     hn::Set(di, hidden.next_word));
  const auto word =
      hn::BitCast(du, hn::GatherIndex(di, reinterpret_cast<const std::int32_t*>(hidden.words),
                                      hn::Add(begins, in_row)));
  const auto shift = hn::ShiftLeft<2>(hn::And(number, hn::Set(du, kPerWord - 1)));
  const auto step = hn::BitCast(di, hn::And(hn::Shr(word, shift), hn::Set(du, 15)));
  const auto power = hn::BitCast(d, hn::ShiftLeft<23>(hn::Sub(hn::Set(di, 127), step)));
  const auto known = hn::IfThenZeroElse(hn::RebindMask(d, hn::Eq(step, hn::Set(di, 15))), power);
  const auto since = hn::Sub(number, hn::Set(du, hidden.phase));
  const auto is_in = [&](std::uint32_t phases) {
    const auto phase = hn::BitCast(di, hn::And(since, hn::Set(du, phases - 1)));
    return hn::RebindMask(d, hn::Eq(phase, hn::Zero(di)));
  };
  const auto in_turn = hn::IfThenElse(is_in(OcclusionUpperBounds::kPhases),
                                      hn::Max(known, hn::Set(d, hidden.phase_bound)), known);
  // A page has no more than two rows; of a third nothing is known.
  const auto none = hn::RebindMask(d, hn::Gt(row, hn::Set(di, 1)));
  const auto one = hn::Set(d, 1.0f);
  return {hn::IfThenElse(none, one, known),
          hn::IfThenElse(hn::Or(is_in(hidden.phases), none), one, in_turn)};
}

// Loudness of one signal per lane, as shares of its maximum.
struct Shares {
  Vector share;
  hn::Vec<Integers> low, high;  // the bands' parts of it, four each
};
HWY_INLINE Shares gather_shares(const LoudnessTable& shares, const ShortlistBlock& block,
                                std::size_t at) {
  static_assert(sizeof(BandShares) == 12 && offsetof(BandShares, parts) == 4);
  const Tag d;
  const Integers di;
  const auto last = hn::Set(d, static_cast<float>(shares.row()) - 1);
  const auto signal = hn::Load(di, reinterpret_cast<const std::int32_t*>(&block.signal[at]));
  const auto delay = hn::MulAdd(hn::Load(d, block.delay_s.data() + at),
                                hn::Set(d, LoudnessTable::kPerS), hn::Set(d, 1.0f));
  const auto column = hn::ConvertTo(di, hn::Min(hn::Max(delay, hn::Zero(d)), last));
  const auto row = hn::Mul(signal, hn::Set(di, static_cast<std::int32_t>(shares.row())));
  const auto word = hn::Mul(hn::Add(row, column), hn::Set(di, 3));
  const auto* const words = reinterpret_cast<const std::int32_t*>(shares.data());
  return {hn::BitCast(d, hn::GatherIndex(di, words, word)), hn::GatherIndex(di, words + 1, word),
          hn::GatherIndex(di, words + 2, word)};
}

// BandMix::of() of the shares.
HWY_INLINE Vector of_mixes(const BandMix* mixes, const Shares& shares) {
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

std::size_t loud_here(std::span<const ShortlistBlock> blocks, float least,
                      const LoudnessTable& shares, const OcclusionUpperBounds::Window& hidden,
                      const AudibleEntries::Columns& found) {
  const Tag d;
  const hn::RebindToUnsigned<Tag> du;
  const auto needed = hn::Set(d, least), one = hn::Set(d, 1.0f);
  std::size_t count = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (std::size_t at = 0; at < kCullBlock; at += hn::Lanes(d)) {
      const ShortlistBlock& block = blocks[b];
      const auto near_by = hn::Load(d, block.upper_bound.data() + at);
      auto loud = hn::Ge(near_by, needed);
      auto share = one, known = one;
      if (shares.row() > 0 && !hn::AllFalse(d, loud)) {
        const Shares now = gather_shares(shares, block, at);
        loud = hn::And(loud, hn::Ge(hn::Mul(near_by, now.share), needed));
        if (hn::AllFalse(d, loud)) continue;
        share = hn::Mul(now.share, of_mixes(&block.mix[at], now));
        loud = hn::And(loud, hn::Ge(hn::Mul(near_by, share), needed));
      }
      if (hn::AllFalse(d, loud)) continue;
      if (hidden.words != nullptr) {
        const Left left = left_of(hidden, block.source.data() + at);
        known = left.known;
        loud = hn::And(loud, hn::Ge(hn::Mul(near_by, hn::Mul(share, left.most)), needed));
        if (hn::AllFalse(d, loud)) continue;
      }
      const auto entry = hn::Iota(du, static_cast<std::uint32_t>(b * kCullBlock + at));
      const auto loud_u = hn::RebindMask(du, loud);
      hn::StoreU(hn::Compress(entry, loud_u), du, found.entry + count);
      hn::StoreU(hn::Compress(share, loud), d, found.share + count);
      hn::StoreU(hn::Compress(known, loud), d, found.known + count);
      count += hn::CountTrue(d, loud);
    }
  return count;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(loud_here);
HWY_EXPORT(upper_bounds_of_all);
// A table takes at most a quarter of a millisecond per keyframe; one that is shorter than half a
// second is of no use.
constexpr std::size_t kMaxDelays = 1 << 12, kMaxShares = 1 << 18, kMinDelays = 25;
}  // namespace

std::size_t find_audible(std::span<const ShortlistBlock> blocks, float least,
                         const LoudnessTable& shares, const OcclusionUpperBounds::Window& hidden,
                         const AudibleEntries::Columns& loud) {
  return HWY_DYNAMIC_DISPATCH(loud_here)(blocks, least, shares, hidden, loud);
}

void upper_bounds_at(std::span<const SourceShape> shapes, float error_m, float* upper_bounds) {
  HWY_DYNAMIC_DISPATCH(upper_bounds_of_all)(shapes, error_m, upper_bounds);
}

// The first and the last entry of a row are for delays out of its range.
void LoudnessTable::tabulate(std::span<const LoudnessTrack> signals, double time_s,
                             float max_delay_s, float error_s) {
  const std::size_t most =
      std::min(kMaxShares / std::max<std::size_t>(signals.size(), 1), kMaxDelays + 2);
  const float wanted = std::max(max_delay_s, 0.0f) * kPerS + 4;
  row_ = wanted < static_cast<float>(most) ? static_cast<std::size_t>(wanted) : most;
  if (signals.empty() || most < kMinDelays) row_ = 0;
  shares_.assign(signals.size() * row_, BandShares::whole());
  if (row_ == 0) return;
  for (std::size_t s = 0; s < signals.size(); ++s)
    signals[s].shares_by_delay(time_s, kPerS, static_cast<double>(error_s),
                               std::span(shares_).subspan(s * row_ + 1, row_ - 2));
}

}  // namespace clamor

#endif
