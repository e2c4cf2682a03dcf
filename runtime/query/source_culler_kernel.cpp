#include "runtime/query/source_culler_kernel.h"

#include <algorithm>
#include <bit>

// Highway compiles what follows once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/query/source_culler_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "runtime/query/culler_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr float kRounding = 2e-6f;  // a few operations in single precision
constexpr float kSlack = 1.0005f;   // the exponential, and sums

// The mask as bits, of the first `count` lanes.
HWY_INLINE std::uint32_t bits_of(Tag d, hn::Mask<Tag> mask, std::size_t count) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(d, mask, bits);
  const std::uint32_t all = bits[0] | static_cast<std::uint32_t>(bits[1]) << 8;
  return count < kCullBlock ? all & ((1u << count) - 1) : all;
}

HWY_INLINE Vector nearest2(Tag d, Vector r2, Vector radius2, const CullQuery& query) {
  return hn::Max(hn::MulSub(r2, hn::Set(d, query.keep - kRounding), hn::Set(d, query.less_m2)),
                 radius2);
}

// Bits of those of at most 16 blocks that may hold a source to keep.
HWY_INLINE std::uint32_t cull_blocks(const CullBounds& bounds, std::size_t blocks,
                                     const CullQuery& query) {
  const Tag d;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const Vectors from = {hn::Set(d, query.from_m.x), hn::Set(d, query.from_m.y),
                        hn::Set(d, query.from_m.z)};
  std::uint32_t which = 0;
  for (std::size_t at = 0; at < blocks; at += hn::Lanes(d)) {
    const Vectors middle = load(d, bounds.middle_m, at), half = load(d, bounds.half_m, at);
    const Vectors way = {hn::Sub(from.x, middle.x), hn::Sub(from.y, middle.y),
                         hn::Sub(from.z, middle.z)};
    const Vectors away = {hn::Max(hn::Sub(hn::Abs(way.x), half.x), zero),
                          hn::Max(hn::Sub(hn::Abs(way.y), half.y), zero),
                          hn::Max(hn::Sub(hn::Abs(way.z), half.z), zero)};
    const auto near2 =
        nearest2(d, dot(away, away), hn::Load(d, bounds.radius2_m2.data() + at), query);
    const auto diffuse = hn::Load(d, bounds.diffuse.data() + at);
    const auto bounce = hn::Load(d, bounds.bounce.data() + at);
    const auto slope = hn::Load(d, bounds.slope.data() + at);
    const auto lobe = hn::Load(d, bounds.lobe.data() + at);
    const auto need = hn::Mul(near2, hn::Set(d, query.threshold));
    const auto slack = hn::Set(d, kSlack);
    const auto all = hn::Add(hn::Add(diffuse, lobe), bounce_up_to(d, one, bounce, slope));
    which |= bits_of(d, hn::Not(hn::Lt(hn::Mul(all, slack), need)), blocks - at) << at;
  }
  return which;
}

HWY_INLINE void cull_block(const CullBlock& block, std::size_t first, std::size_t count,
                           const CullQuery& query, CullResult& result) {
  const Tag d;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f), least = hn::Set(d, query.threshold);
  const auto slack = hn::Set(d, kSlack);
  for (std::size_t at = 0; at < count; at += hn::Lanes(d)) {
    const Vectors position = load(d, block.position_m, at);
    const Vectors way = {hn::Sub(hn::Set(d, query.from_m.x), position.x),
                         hn::Sub(hn::Set(d, query.from_m.y), position.y),
                         hn::Sub(hn::Set(d, query.from_m.z), position.z)};
    const auto r2 = dot(way, way);
    const auto near2 = nearest2(d, r2, hn::Load(d, block.radius2_m2.data() + at), query);
    const auto need = hn::Mul(least, near2);
    const auto diffuse = hn::Load(d, block.diffuse.data() + at);
    const auto bounce = hn::Load(d, block.bounce.data() + at);
    const auto slope = hn::Load(d, block.slope.data() + at);
    const auto lobe = hn::Load(d, block.lobe.data() + at);
    // Negated comparisons keep what is infinite.
    const auto all = hn::Add(hn::Add(diffuse, lobe), bounce_up_to(d, one, bounce, slope));
    const auto close = hn::Not(hn::Lt(hn::Mul(all, slack), need));
    if (hn::AllFalse(d, close)) continue;
    const auto over_r = hn::Div(one, hn::Sqrt(hn::Max(r2, hn::Set(d, 1e-12f))));
    // An error of the position turns the direction by at most asin(error / r).
    const auto sin_t = hn::Mul(over_r, hn::Set(d, query.error_m));
    const auto turns_far = hn::Gt(sin_t, hn::Set(d, 0.99f));
    const auto cos_t = hn::Sqrt(hn::Max(hn::NegMulAdd(sin_t, sin_t, one), zero));
    const auto highest = [&](Vector dot_m) {
      const auto cos = hn::Min(hn::MulAdd(dot_m, over_r, hn::Set(d, kRounding)), one);
      const auto sin = hn::Sqrt(hn::Max(hn::NegMulAdd(cos, cos, one), zero));
      const auto nearer = hn::MulAdd(cos, cos_t, hn::MulAdd(sin, sin_t, hn::Set(d, kRounding)));
      return hn::IfThenElse(hn::Or(turns_far, hn::Ge(cos, cos_t)), one, hn::Min(nearer, one));
    };
    const Vectors normal = load(d, block.normal, at), mirror = load(d, block.mirror, at);
    const auto is_emitter = hn::Lt(slope, zero);
    const auto cos_o = hn::IfThenElse(is_emitter, one, highest(dot(way, normal)));
    const auto cos_a = highest(dot(way, mirror));
    const auto tilt = tilt_of(d, cos_o, normal, mirror, is_emitter);
    const auto left = decay(d, hn::Mul(hn::Load(d, block.fall.data() + at), hn::Sub(one, cos_a)));
    const auto even =
        hn::MulAdd(diffuse, cos_o, bounce_up_to(d, hn::Max(cos_o, zero), bounce, slope));
    const auto most = hn::Mul(slack, hn::MulAdd(hn::Mul(lobe, tilt), left, even));
    const auto passes = hn::And(hn::And(close, hn::Gt(cos_o, zero)), hn::Not(hn::Lt(most, need)));
    if (hn::AllFalse(d, passes)) continue;
    HWY_ALIGN float upper_bounds[kCullBlock];
    hn::Store(hn::Div(most, near2), d, upper_bounds);
    for (std::uint32_t bits = bits_of(d, passes, count - at); bits != 0; bits &= bits - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
      const std::size_t index = first + at + lane;
      result.bits[index / 64] |= std::uint64_t{1} << (index % 64);
      result.upper_bound[index] = upper_bounds[lane];
    }
  }
}

void cull_here(std::span<const CullBounds> bounds, std::span<const CullBlock> blocks,
               std::size_t count, const CullQuery& query, CullResult& result) {
  for (std::size_t first = 0; first < blocks.size(); first += kCullBlock) {
    std::uint32_t bits =
        cull_blocks(bounds[first / kCullBlock], std::min(kCullBlock, blocks.size() - first), query);
    for (; bits != 0; bits &= bits - 1) {
      const std::size_t b = first + static_cast<std::size_t>(std::countr_zero(bits));
      if (const std::uint32_t later = bits & (bits - 1); later != 0)
        prefetch_to_read(&blocks[first + static_cast<std::size_t>(std::countr_zero(later))],
                         sizeof(CullBlock));
      const std::size_t in_block = std::min(kCullBlock, count - b * kCullBlock);
      result.tested += static_cast<std::uint32_t>(in_block);
      cull_block(blocks[b], b * kCullBlock, in_block, query, result);
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(cull_here);
}  // namespace

void cull_with(std::span<const CullBounds> bounds, std::span<const CullBlock> blocks,
               std::size_t count, const CullQuery& query, CullResult& result) {
  HWY_DYNAMIC_DISPATCH(cull_here)(bounds, blocks, count, query, result);
}

}  // namespace clamor

#endif
