#include "runtime/probes/copy_kernel.h"

#include <algorithm>
#include <cmath>

#include "runtime/probes/probe_sources.h"
#include "runtime/propagation/source_page.h"

// Highway compiles what follows once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/probes/copy_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "runtime/propagation/source_bound_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

HWY_INLINE Vectors in_all_lanes(const Vec3f& v) {
  const Tag d;
  return {hn::Set(d, v.x), hn::Set(d, v.y), hn::Set(d, v.z)};
}

// Rounding of places, which turns the mirror direction by at most rounding / kLeastDistance_m.
HWY_INLINE float rounding_of(const SourceBound& source) {
  return 0x1p-20f * (1 + length(source.position_m));
}

// The bounds of a reflection as copies at `places` have it, in parts of `factor`.
HWY_INLINE Vector upper_bound_of_copies(const FirstReflection& reflection, const Vectors& places) {
  const Tag d;
  const SourceBound& source = reflection.bound;
  const Vectors position = in_all_lanes(source.position_m), normal = in_all_lanes(source.normal);
  const float rounding_m = rounding_of(source);
  const Vectors path = {hn::Sub(position.x, places.x), hn::Sub(position.y, places.y),
                        hn::Sub(position.z, places.z)};
  const auto least = hn::Set(d, static_cast<float>(kLeastDistance_m));
  const auto length_m = hn::Sqrt(dot(path, path));
  const auto over_length = hn::Div(hn::Set(d, 1.0f), hn::Max(length_m, hn::Set(d, 1e-9f)));
  const auto along = dot(path, normal);
  // The side from which the probe's sound arrives; sound that is transmitted keeps its direction.
  const bool is_reflected = dot(source.position_m, source.normal) < 0;
  const auto outside = is_reflected ? hn::Neg(along) : along;
  const auto lifted = hn::Add(outside, hn::Set(d, rounding_m));
  const auto cosine = hn::Min(hn::Mul(hn::Max(lifted, hn::Zero(d)), over_length), hn::Set(d, 1.0f));
  const auto near = hn::Max(hn::Sub(length_m, hn::Set(d, rounding_m)), least);
  const auto irradiance = hn::Div(cosine, hn::Mul(near, near));
  const auto ratio = hn::Min(hn::Div(irradiance, hn::Set(d, reflection.irradiance_of_probe)),
                             hn::Set(d, static_cast<float>(kMaxIrradianceRatio)));
  const auto turned = is_reflected ? hn::Add(along, along) : hn::Zero(d);
  const auto mirror_of = [&](Vector path_part, Vector normal_part) {
    return hn::Mul(hn::NegMulAdd(turned, normal_part, path_part), over_length);
  };
  const SourceLanes lanes = {
      position,
      normal,
      {mirror_of(path.x, normal.x), mirror_of(path.y, normal.y), mirror_of(path.z, normal.z)},
      hn::Set(d, source.radius2_m2),
      hn::Set(d, source.diffuse),
      hn::Set(d, source.compensation),
      hn::Set(d, source.lobe),
      hn::Set(d, source.fall),
      hn::Set(d, source.slope)};
  // An error of the listener's place by a share of its distance turns directions as much.
  const float away_m = length(reflection.listener_m - source.position_m);
  const float turn = rounding_m / static_cast<float>(kLeastDistance_m);
  const auto bound = upper_bound_of(lanes, reflection.listener_m, rounding_m + turn * away_m);
  // Nearer than the least distance the direction of the path is not known well enough.
  const auto any_direction =
      hn::Div(hn::Set(d, kBoundSlack * (source.diffuse + source.compensation + source.lobe)),
              hn::Max(hn::Set(d, source.radius2_m2),
                      hn::Set(d, std::max(away_m * away_m * 0.999f - rounding_m, 0.0f))));
  const auto unknown = hn::Lt(length_m, least);
  return hn::Mul(hn::Mul(hn::Set(d, kBoundSlack), ratio),
                 hn::IfThenElse(unknown, any_direction, bound));
}

void find_reaching(const FirstReflection& reflection, const CopyRows& copies, std::size_t first,
                   std::size_t count, ReachingCopies& reaching) {
  const Tag d;
  const hn::RebindToUnsigned<Tag> du;
  const auto threshold = hn::Set(d, reflection.threshold);
  for (std::size_t at = 0; at < count; at += hn::Lanes(d)) {
    const std::size_t c = first + at;
    const Vectors places = {hn::LoadU(d, &copies.x_m[c]), hn::LoadU(d, &copies.y_m[c]),
                            hn::LoadU(d, &copies.z_m[c])};
    const auto bound =
        hn::Mul(upper_bound_of_copies(reflection, places), hn::LoadU(d, &copies.factor[c]));
    // The negated comparison keeps what is infinite.
    const auto passes = hn::And(hn::Not(hn::Lt(bound, threshold)),
                                hn::And(hn::Gt(bound, hn::Zero(d)), hn::FirstN(d, count - at)));
    if (hn::AllFalse(d, passes)) continue;
    const auto index = hn::Iota(du, static_cast<std::uint32_t>(c));
    hn::StoreU(hn::Compress(index, hn::RebindMask(du, passes)), du,
               reaching.index.data() + reaching.count);
    hn::StoreU(hn::Compress(bound, passes), d, reaching.upper_bound.data() + reaching.count);
    reaching.count += hn::CountTrue(d, passes);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace clamor
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace clamor {

namespace {
HWY_EXPORT(find_reaching);
}  // namespace

void CopyRows::clear() {
  for (auto* const row : {&x_m, &y_m, &z_m, &factor}) row->clear();
}

void CopyRows::add(const Vec3& from_probe_m, float of_bounds) {
  x_m.push_back(static_cast<float>(from_probe_m.x));
  y_m.push_back(static_cast<float>(from_probe_m.y));
  z_m.push_back(static_cast<float>(from_probe_m.z));
  factor.push_back(of_bounds);
}

void CopyRows::pad() {
  for (auto* const row : {&x_m, &y_m, &z_m, &factor}) row->resize(row->size() + kCullBlock);
}

void ReachingCopies::make_room(std::size_t max_count) {
  count = 0;
  if (index.size() >= max_count + kCullBlock) return;
  index.resize(max_count + kCullBlock);
  upper_bound.resize(max_count + kCullBlock);
}

void find_reaching_copies(const FirstReflection& reflection, const CopyRows& copies,
                          std::size_t first, std::size_t count, ReachingCopies& reaching) {
  reaching.make_room(count);
  HWY_DYNAMIC_DISPATCH(find_reaching)(reflection, copies, first, count, reaching);
}

}  // namespace clamor

#endif
