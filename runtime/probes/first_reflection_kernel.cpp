#include "runtime/probes/first_reflection_kernel.h"

#include <algorithm>
#include <cmath>

#include "runtime/probes/probe_sources.h"

// Highway compiles what follows once per instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/probes/first_reflection_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "runtime/propagation/source_bound_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace clamor {
namespace HWY_NAMESPACE {
namespace {

using Block = FirstReflectionRows::Block;

// All lanes of a query share its margins.
struct Margins {
  Margins(const FirstReflectionRows& rows, const FirstReflectionQuery& query)
      : rounding_m(0x1p-20f * (1 + rows.reach_m() + length(query.source_m))),
        away_m(length(query.listener_m) + rows.reach_m()) {}
  float rounding_m;  // of positions; turns the mirror direction by rounding / kLeastDistance_m
  float away_m;      // of the listener from any reflection, at most
};

// Upper bounds for sources of any direction and irradiance.
HWY_INLINE Vector bounds_of_any_source(const Block& block, std::size_t lane,
                                       const FirstReflectionQuery& query, const Margins& margins) {
  const Tag d;
  const Vectors away = from_to(load(block.position_m, lane), query.listener_m);
  const auto least2 = hn::MulSub(dot(away, away), hn::Set(d, 0.999f),
                                 hn::Set(d, margins.rounding_m * (1 + margins.away_m)));
  const auto peak = hn::Add(load(block.diffuse, lane),
                            hn::Add(load(block.compensation, lane), load(block.lobe, lane)));
  const auto highest = hn::Set(d, kBoundSlack * static_cast<float>(kMaxIrradianceRatio));
  return hn::Div(hn::Mul(highest, peak), hn::Max(least2, load(block.radius2_m2, lane)));
}

// Upper bounds for the source's own place.
HWY_INLINE Vector upper_bounds(const Block& block, std::size_t lane,
                               const FirstReflectionQuery& query, const Margins& margins) {
  const Tag d;
  SourceLanes lanes = load_sources(block, lane);
  const auto of_source = [&](Vector at, float source) { return hn::Sub(at, hn::Set(d, source)); };
  const Vectors path = {of_source(lanes.position.x, query.source_m.x),
                        of_source(lanes.position.y, query.source_m.y),
                        of_source(lanes.position.z, query.source_m.z)};
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f), slack = hn::Set(d, kBoundSlack);
  const auto rounding = hn::Set(d, margins.rounding_m);
  const auto least = hn::Set(d, static_cast<float>(kLeastDistance_m));
  const auto length_m = hn::Sqrt(dot(path, path));
  const auto over_length = hn::Div(one, hn::Max(length_m, hn::Set(d, 1e-9f)));
  const auto along = dot(path, lanes.normal);
  // The side from which sound arrives; sound that is transmitted keeps its direction.
  const auto is_reflected = hn::Lt(load(block.side, lane), zero);
  const auto outside = hn::IfThenElse(is_reflected, hn::Neg(along), along);
  const auto lifted = hn::Add(outside, rounding);
  const auto cosine = hn::Min(hn::Mul(hn::Max(lifted, zero), over_length), one);
  const auto near = hn::Max(hn::Sub(length_m, rounding), least);
  const auto irradiance = hn::Div(cosine, hn::Mul(near, near));
  const auto ratio = hn::Min(hn::Div(irradiance, load(block.irradiance, lane)),
                             hn::Set(d, static_cast<float>(kMaxIrradianceRatio)));
  const auto turned = hn::IfThenElse(is_reflected, hn::Add(along, along), zero);
  const auto mirror_of = [&](Vector path_part, Vector normal_part) {
    return hn::Mul(hn::NegMulAdd(turned, normal_part, path_part), over_length);
  };
  lanes.mirror = {mirror_of(path.x, lanes.normal.x), mirror_of(path.y, lanes.normal.y),
                  mirror_of(path.z, lanes.normal.z)};
  // An error of the listener's place by a share of its distance turns directions as much.
  const float turn = margins.rounding_m / static_cast<float>(kLeastDistance_m);
  const auto bound =
      upper_bound_of(lanes, query.listener_m, margins.rounding_m + turn * margins.away_m);
  // Nearer than the least distance the direction of the path is not known well enough.
  return hn::IfThenElse(hn::Lt(length_m, least), bounds_of_any_source(block, lane, query, margins),
                        hn::Mul(hn::Mul(slack, ratio), bound));
}

void find_reaching(const FirstReflectionRows& rows, const FirstReflectionQuery& query,
                   CulledPage& reaching) {
  const Margins margins(rows, query);
  std::size_t first = 0;
  for (const Block& block : rows.blocks()) {
    const std::size_t count = std::min(kCullBlock, rows.size() - first);
    for (std::size_t lane = 0; lane < count; lane += hn::Lanes(Tag()))
      keep_reaching(upper_bounds(block, lane, query, margins), query.threshold, first + lane,
                    count - lane, reaching);
    first += kCullBlock;
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

void FirstReflectionRows::clear() {
  blocks_.clear();
  size_ = 0;
  reach_m_ = 0;
}

float FirstReflectionRows::upper_bound(const Vec3f& listener_m) const {
  if (size_ == 0) return 0;
  const Vec3f away_m = listener_m - glm::clamp(listener_m, low_m_, high_m_);
  const float r2_m2 = std::max(dot(away_m, away_m) * 0.999f, min_radius2_m2_);
  return 1.001f * static_cast<float>(kMaxIrradianceRatio) * peak_ / r2_m2;
}

void FirstReflectionRows::add(const ProbeBounds& bounds, Source reflection, const Vec3& place_m) {
  const Vec3f position_m(Vec3(reflection.position_m) - place_m);
  const double irradiance =
      irradiance_from(Vec3(reflection.position_m) - place_m, Vec3(reflection.normal));
  reflection.mirror = Vec3f(0);  // the compensation is the highest at grazing incidence
  const auto at_1m = bounds.radiation().upper_bound(reflection, bounds.weights());
  const SourceBound bound = source_bound(bounds.radiation(), reflection, at_1m);
  const std::size_t lane = size_++ % kCullBlock;
  if (lane == 0) blocks_.emplace_back();
  Block& block = blocks_.back();
  block.set(lane, bound, position_m, at_1m.mix);
  block.irradiance[lane] = static_cast<float>(irradiance);
  block.side[lane] = dot(Vec3(bound.position_m) - place_m, Vec3(bound.normal)) < 0 ? -1.0f : 1.0f;
  const float peak = bound.diffuse + bound.compensation + bound.lobe;
  const bool is_first = size_ == 1;
  reach_m_ = std::max(reach_m_, length(position_m));
  low_m_ = is_first ? position_m : glm::min(low_m_, position_m);
  high_m_ = is_first ? position_m : glm::max(high_m_, position_m);
  min_radius2_m2_ = is_first ? bound.radius2_m2 : std::min(min_radius2_m2_, bound.radius2_m2);
  peak_ = is_first ? peak : std::max(peak_, peak);
}

void find_reaching_reflections(const FirstReflectionRows& rows, const FirstReflectionQuery& query,
                               CulledPage& reaching) {
  reaching.begin(rows.size());
  HWY_DYNAMIC_DISPATCH(find_reaching)(rows, query, reaching);
}

}  // namespace clamor

#endif
