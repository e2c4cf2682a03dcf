// source_bound_lanes-inl.h: evaluates upper bounds of priorities (source_bound.h), one per lane.
//
// All rounding errs towards a higher bound: distances by a margin, directions by the angle that the
// margin is seen under, sums by a slack. So no bound is lower than a sum in double precision.
//
// For source_page_kernel.cpp, query/shortlist_kernel.cpp and probes/first_reflection_kernel.cpp,
// which compile it once per instruction set; hence the unusual include guard.
#if defined(CLAMOR_RUNTIME_SOURCE_BOUND_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef CLAMOR_RUNTIME_SOURCE_BOUND_LANES_INL_H
#undef CLAMOR_RUNTIME_SOURCE_BOUND_LANES_INL_H
#else
#define CLAMOR_RUNTIME_SOURCE_BOUND_LANES_INL_H
#endif

#include <array>
#include <cstddef>
#include <cstdint>

#include <hwy/highway.h>

#include "common/reflection_law-inl.h"
#include "common/vec.h"
#include "runtime/propagation/source_page.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

using Tag = hn::CappedTag<float, 16>;
using Vector = hn::Vec<Tag>;

struct Vectors {
  Vector x, y, z;
};

// A SourceBound per lane.
struct SourceLanes {
  Vectors position, normal, mirror;
  Vector radius2, diffuse, compensation, lobe, fall, slope;
};

HWY_INLINE Vector load(const CullBlock::Row& row, std::size_t at) {
  return hn::Load(Tag(), row.data() + at);
}
HWY_INLINE Vectors load(const std::array<CullBlock::Row, 3>& rows, std::size_t at) {
  return {load(rows[0], at), load(rows[1], at), load(rows[2], at)};
}
HWY_INLINE SourceLanes load_sources(const CullBlock& block, std::size_t at) {
  return {load(block.position_m, at), load(block.normal, at),  load(block.mirror, at),
          load(block.radius2_m2, at), load(block.diffuse, at), load(block.compensation, at),
          load(block.lobe, at),       load(block.fall, at),    load(block.slope, at)};
}

HWY_INLINE Vectors from_to(const Vectors& from, const Vec3f& to) {
  const Tag d;
  return {hn::Set(d, to.x) - from.x, hn::Set(d, to.y) - from.y, hn::Set(d, to.z) - from.z};
}

HWY_INLINE Vector dot(const Vectors& a, const Vectors& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

// Lower bound of max(r, radius)^2 for distances within `error_m` of r.
HWY_INLINE Vector nearest2(Vector r, Vector radius2, float error_m) {
  const Tag d;
  const auto near = hn::MulSub(r, hn::Set(d, 1 - kBoundRounding), hn::Set(d, error_m));
  return hn::Max(hn::Mul(hn::Max(near, hn::Zero(d)), near), radius2);
}

// Upper bounds for all places within `error_m` of the listener's.
HWY_INLINE Vector upper_bound_of(const SourceLanes& source, const Vec3f& listener_m,
                                 float error_m) {
  const Tag d;
  const auto one = hn::Set(d, 1.0f), zero = hn::Zero(d), rounding = hn::Set(d, kBoundRounding);
  const Vectors way = from_to(source.position, listener_m);
  const auto r = hn::Sqrt(dot(way, way)), min_r = hn::Set(d, kMinBoundDistance_m);
  const auto over_r = hn::Div(one, hn::Max(r, min_r));
  // An error of the position turns the direction by at most t = asin(error / r).
  const auto sin_t = hn::Mul(over_r, hn::Set(d, error_m));
  const auto any_direction = hn::Or(hn::Gt(sin_t, hn::Set(d, 0.99f)), hn::Lt(r, min_r));
  const auto cos_t = hn::Sqrt(hn::Max(hn::NegMulAdd(sin_t, sin_t, one), zero));
  const auto highest_cosine = [&](const Vectors& axis) {
    const auto cos = hn::Min(hn::MulAdd(dot(way, axis), over_r, rounding), one);
    const auto sin = hn::Sqrt(hn::Max(hn::NegMulAdd(cos, cos, one), zero));
    const auto turned = hn::MulAdd(cos, cos_t, hn::MulAdd(sin, sin_t, rounding));
    return hn::IfThenElse(hn::Or(any_direction, hn::Ge(cos, cos_t)), one, hn::Min(turned, one));
  };
  const auto is_emitter = hn::Lt(source.slope, zero);
  const auto cos_o = hn::IfThenElse(is_emitter, one, hn::Max(highest_cosine(source.normal), zero));
  const auto cos_a = highest_cosine(source.mirror);
  // The lobe is lower below the angle of incidence.
  const auto min_cosine = hn::Set(d, 1e-6f);
  const auto cos_i = hn::Max(hn::Sub(dot(source.mirror, source.normal), min_cosine), min_cosine);
  const auto tilt = hn::IfThenElse(is_emitter, one, hn::Min(hn::Div(cos_o, cos_i), one));
  const auto sum = density_bound(source.diffuse, source.lobe, source.compensation, source.slope,
                                 cos_o, tilt, source.fall * (one - cos_a));
  return hn::Set(d, kBoundSlack) * sum / nearest2(r, source.radius2, error_m);
}

// Adds the first `count` lanes whose bounds reach the threshold to those found, from this index on.
template <class Found>
HWY_INLINE void keep_reaching(Vector bound, float threshold, std::size_t first, std::size_t count,
                              Found& found) {
  const Tag d;
  const hn::RebindToUnsigned<Tag> du;
  // The negated comparisons keep what is infinite.
  const auto is_below = hn::Or(hn::Lt(bound, hn::Set(d, threshold)), hn::Le(bound, hn::Zero(d)));
  const auto passes = hn::And(hn::Not(is_below), hn::FirstN(d, count));
  if (hn::AllFalse(d, passes)) return;
  const auto index = hn::Iota(du, static_cast<std::uint32_t>(first));
  hn::StoreU(hn::Compress(index, hn::RebindMask(du, passes)), du, found.index.data() + found.count);
  hn::StoreU(hn::Compress(bound, passes), d, found.upper_bound.data() + found.count);
  found.count += hn::CountTrue(d, passes);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#endif
