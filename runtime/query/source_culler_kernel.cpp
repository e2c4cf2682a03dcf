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

constexpr float kRounds = 2e-6f;   // a few operations of single precision
constexpr float kSlack = 1.0005f;  // the exponential, and sums

// The lanes that are set, of those before `count`.
HWY_INLINE std::uint32_t bits_of(Tag d, hn::Mask<Tag> mask, std::size_t count) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(d, mask, bits);
  const std::uint32_t all = bits[0] | static_cast<std::uint32_t>(bits[1]) << 8;
  return count < kCullBlock ? all & ((1u << count) - 1) : all;
}

HWY_INLINE Vector nearest2(Tag d, Vector r2, Vector radius2, const CullQuery& query) {
  return hn::Max(hn::MulSub(r2, hn::Set(d, query.keep - kRounds), hn::Set(d, query.less_m2)),
                 radius2);
}

// The highest cosine between a direction within the angle w of a way and one in a cone: with g the
// angle between way and axis and h the cone's half angle, of g - (w + h), or 1.
HWY_INLINE Vector highest_cos(Tag d, Vector cos_g, Vector cos_w, Vector sin_w, Vector cos_h,
                              Vector sin_h) {
  const auto one = hn::Set(d, 1.0f), give = hn::Set(d, 1e-3f), zero = hn::Zero(d);
  const auto sin_g = hn::Sqrt(hn::Max(hn::NegMulAdd(cos_g, cos_g, one), zero));
  const auto cos_both = hn::NegMulAdd(sin_w, sin_h, hn::Mul(cos_w, cos_h));
  const auto sin_both = hn::MulAdd(sin_w, cos_h, hn::Mul(cos_w, sin_h));
  const auto outside = hn::And(hn::Gt(sin_both, give), hn::Lt(cos_g, hn::Sub(cos_both, give)));
  const auto cos_between = hn::MulAdd(cos_g, cos_both, hn::MulAdd(sin_g, sin_both, give));
  return hn::IfThenElse(outside, hn::Min(cos_between, one), one);
}

// Which of at most 16 blocks may hold a source that is let through.
HWY_INLINE std::uint32_t sift_blocks(const CullBounds& bounds, std::size_t blocks,
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
    const auto need = hn::Mul(near2, hn::Set(d, query.least));
    const auto slack = hn::Set(d, kSlack);
    const auto all = hn::Add(hn::Add(diffuse, lobe), bounce_up_to(d, one, bounce, slope));
    const auto close = hn::Not(hn::Lt(hn::Mul(all, slack), need));
    if (hn::AllFalse(d, close)) continue;
    // The ways to the place, from anywhere in the ball round the box.
    const auto way2 = hn::Max(dot(way, way), hn::Set(d, 1e-12f));
    const auto over_way = hn::Div(one, hn::Sqrt(way2));
    const auto ball = hn::Add(hn::Sqrt(dot(half, half)), hn::Set(d, query.give_m));
    const auto sin_w = hn::Mul(ball, over_way);
    const auto inside = hn::Ge(sin_w, one);
    const auto cos_w = hn::Sqrt(hn::Max(hn::NegMulAdd(sin_w, sin_w, one), zero));
    const auto cos_o =
        hn::IfThenElse(inside, one,
                       highest_cos(d, hn::Mul(dot(way, load(d, bounds.normal, at)), over_way),
                                   cos_w, sin_w, hn::Load(d, bounds.normal_cos.data() + at),
                                   hn::Load(d, bounds.normal_sin.data() + at)));
    const auto cos_a =
        hn::IfThenElse(inside, one,
                       highest_cos(d, hn::Mul(dot(way, load(d, bounds.mirror, at)), over_way),
                                   cos_w, sin_w, hn::Load(d, bounds.mirror_cos.data() + at),
                                   hn::Load(d, bounds.mirror_sin.data() + at)));
    const auto left = decay(d, hn::Mul(hn::Load(d, bounds.fall.data() + at), hn::Sub(one, cos_a)));
    const auto before = hn::Max(cos_o, zero);
    const auto even = hn::MulAdd(diffuse, before, bounce_up_to(d, before, bounce, slope));
    const auto most = hn::Mul(slack, hn::MulAdd(lobe, left, even));
    const auto passes = hn::And(hn::And(close, hn::Gt(cos_o, zero)), hn::Not(hn::Lt(most, need)));
    which |= bits_of(d, passes, blocks - at) << at;
  }
  return which;
}

HWY_INLINE void sift_block(const CullBlock& block, std::size_t first, std::size_t count,
                           const CullQuery& query, CullResult& sifted) {
  const Tag d;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f), least = hn::Set(d, query.least);
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
    // By negations, so that what is infinite passes.
    const auto all = hn::Add(hn::Add(diffuse, lobe), bounce_up_to(d, one, bounce, slope));
    const auto close = hn::Not(hn::Lt(hn::Mul(all, slack), need));
    if (hn::AllFalse(d, close)) continue;
    const auto over_r = hn::Div(one, hn::Sqrt(hn::Max(r2, hn::Set(d, 1e-12f))));
    // A step of `give` turns the way by at most asin(give / r).
    const auto sin_t = hn::Mul(over_r, hn::Set(d, query.give_m));
    const auto turns_far = hn::Gt(sin_t, hn::Set(d, 0.99f));
    const auto cos_t = hn::Sqrt(hn::Max(hn::NegMulAdd(sin_t, sin_t, one), zero));
    const auto highest = [&](Vector dot_m) {
      const auto cos = hn::Min(hn::MulAdd(dot_m, over_r, hn::Set(d, kRounds)), one);
      const auto sin = hn::Sqrt(hn::Max(hn::NegMulAdd(cos, cos, one), zero));
      const auto nearer = hn::MulAdd(cos, cos_t, hn::MulAdd(sin, sin_t, hn::Set(d, kRounds)));
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
    HWY_ALIGN float ceilings[kCullBlock];
    hn::Store(hn::Div(most, near2), d, ceilings);
    for (std::uint32_t bits = bits_of(d, passes, count - at); bits != 0; bits &= bits - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
      const std::uint32_t index = block.index[at + lane];
      sifted.bits[index / 64] |= std::uint64_t{1} << (index % 64);
      sifted.ceiling[index] = ceilings[lane];
      sifted.slot[index] = static_cast<std::uint16_t>(first + at + lane);
    }
  }
}

void sift_here(std::span<const CullBounds> bounds, std::span<const CullBlock> blocks,
               std::size_t count, const CullQuery& query, CullResult& sifted) {
  for (std::size_t first = 0; first < blocks.size(); first += kCullBlock) {
    std::uint32_t bits =
        sift_blocks(bounds[first / kCullBlock], std::min(kCullBlock, blocks.size() - first), query);
    for (; bits != 0; bits &= bits - 1) {
      const std::size_t b = first + static_cast<std::size_t>(std::countr_zero(bits));
      if (const std::uint32_t later = bits & (bits - 1); later != 0)
        prefetch_to_read(&blocks[first + static_cast<std::size_t>(std::countr_zero(later))],
                         sizeof(CullBlock));
      const std::size_t in_block = std::min(kCullBlock, count - b * kCullBlock);
      sifted.looked_at += static_cast<std::uint32_t>(in_block);
      sift_block(blocks[b], b * kCullBlock, in_block, query, sifted);
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
HWY_EXPORT(sift_here);
}  // namespace

void cull_with(std::span<const CullBounds> bounds, std::span<const CullBlock> blocks,
               std::size_t count, const CullQuery& query, CullResult& sifted) {
  HWY_DYNAMIC_DISPATCH(sift_here)(bounds, blocks, count, query, sifted);
}

}  // namespace clamor

#endif
