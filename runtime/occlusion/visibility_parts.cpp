// visibility_parts.cpp: which visibilities of a VisibilityCache are stale after movable parts have
// moved, and how they are renewed.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/ray_timer.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/propagation/source_number.h"

namespace clamor {

namespace {

// Paths that estimates cast are at most so many times the lowest band's longest detour longer than
// the straight line, because their chords leave the ellipse (fresnel_zone.cpp).
constexpr float kMaxStretch = 3.2f;
// Detour of the zone around a straight line within which a reflection is renewed at once: that of
// the bands from 1 kHz on.
constexpr float kNearDetour_m = 0.35f;

constexpr std::int64_t kMaxRaysPerEstimate = 600;  // of a medium one
constexpr std::int64_t kDirectBudgets = 8;         // of direct sounds, in budgets of a keyframe

}  // namespace

void VisibilityCache::mark_stale() {
  parts_keyframe_ = keyframe_;
  refresh_.idle_keyframes = 0;
  entries_.for_each([this](VisibilityEntry& entry) { mark_stale(entry); });
  changed_parts_.clear();
}

// The path may be reflected on its way; it does not become longer by that.
void VisibilityCache::mark_stale(VisibilityEntry& entry) {
  if (entry.is_stale) return;
  const Vec3f place_m(place_);
  const float length_m = glm::length(place_m - entry.origin_m);
  const float margin_m = std::sqrt(kNearDetour_m * (2 * length_m + kNearDetour_m)) / 2;
  const auto longest_m = static_cast<float>(2 * wavelength_m(0, speed_of_sound_mps_));
  // The path of an image runs anywhere between mirrors.
  const bool is_near =
      entry.is_image || changed_parts_.pass_near(entry.origin_m, place_m, margin_m);
  const bool is_in_zone = is_near || changed_parts_.are_reached(entry.origin_m, place_m,
                                                                length_m + kMaxStretch * longest_m);
  if (!is_in_zone) return;
  entry.estimate_is_stale = true;
  if (!is_near && !entry.is_direct && !options_.exact) return;
  entry.is_stale = true;
  entries_.set_occluded(entry, false);
  if (entry.step == OcclusionUpperBounds::kUnoccluded) return;
  entry.step = OcclusionUpperBounds::kUnoccluded;
  if (!is_moving_source(entry.number)) upper_bounds_.set(entry.number, entry.step);
}

// Estimates direct sounds with all edges, as long as there are rays, so that an edge that sweeps
// across a path is not heard in steps. Returns how many there are, which come first in `stale`.
std::size_t VisibilityCache::renew_direct(std::span<const Wanted> stale) {
  std::size_t count = 0;
  while (count < stale.size() && entries_[stale[count].index].is_direct) ++count;
  std::int64_t rays = kDirectBudgets * std::int64_t{options_.rays_per_keyframe};
  for (std::size_t i = 0; i < count && rays > 0; ++i) {
    const std::int64_t before = rays_left_;
    estimate(entries_[stale[i].index], *stale[i].source, VisibilityPrecision::kFine);
    rays -= before - std::exchange(rays_left_, before);
  }
  return count;
}

// Direct sounds have a budget of their own. Reflections are estimated as long as a line test is
// left for each of the others.
void VisibilityCache::renew(std::span<const Wanted> stale) {
  const RayTimer time(statistics_.ray_ms);
  const std::int64_t reserve = std::int64_t{options_.rays_per_keyframe} * 3 / 4;
  std::size_t next = renew_direct(stale);
  for (; next < stale.size(); ++next) {
    const auto line_tests = static_cast<std::int64_t>(stale.size() - next);
    if (rays_left_ - reserve < kMaxRaysPerEstimate + line_tests) break;
    estimate(entries_[stale[next].index], *stale[next].source, VisibilityPrecision::kMedium);
  }
  for (; next < stale.size() && rays_left_ > reserve; ++next)
    test_line(entries_[stale[next].index], *stale[next].source);
  for (; next < stale.size(); ++next)
    statistics_.late += entries_[stale[next].index].is_stale ? 1 : 0;
}

}  // namespace clamor
