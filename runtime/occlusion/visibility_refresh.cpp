// visibility_refresh.cpp: which sources a VisibilityCache retests, and in which order.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "runtime/occlusion/ray_timer.h"
#include "runtime/occlusion/visibility_cache.h"

namespace clamor {

namespace {

constexpr std::int64_t kMinRaysForEstimate = 50;  // about what a medium estimate takes
constexpr std::int64_t kRaysPerTask = 10;         // bounds how many tasks are sorted
constexpr std::uint32_t kMaxAge_keyframes = 50;   // older estimates are equally urgent
constexpr int kMinPredictions = 20;               // for a mean error
constexpr double kRecentRadii = 0.1;  // a line test from within this many radii is repeated later
constexpr double kChangeClockRate = 0.25;  // of the way to the grid's clock per keyframe
constexpr double kMinDistance2_m2 = 1e-2;
constexpr std::size_t kPrefetchDistance = 24;

}  // namespace

// Collects the tasks of one phase's sources, or of all.
void VisibilityCache::collect_tasks(std::span<const Wanted> wanted, double tau, std::uint32_t phase,
                                    bool all) {
  statistics_.wanted = 0;
  std::size_t found_by_retest = 0;
  std::vector<std::uint32_t>& in_phase = refresh_.in_phase;
  in_phase.clear();
  for (std::uint32_t w = 0; w < wanted.size(); ++w)
    if (all || OcclusionUpperBounds::phase_of(wanted[w].number) == phase) in_phase.push_back(w);
  for (std::size_t i = 0; i < in_phase.size(); ++i) {
    if (i + kPrefetchDistance < in_phase.size())
      __builtin_prefetch(&entries_[wanted[in_phase[i + kPrefetchDistance]].index], 1);
    const Wanted& one = wanted[in_phase[i]];
    const Index index = one.index & ~VisibilityEntries::kOccluded;
    VisibilityEntry& entry = entries_[index];
    entry.used = keyframe_;
    entry.share = one.share;
    double priority = one.priority;
    if (entry.occluded) {
      const Vec3 path_m = place_ - Vec3(one.source->position_m);
      priority = static_cast<double>(entry.priority_at_1m) /
                 std::max(dot(path_m, path_m), kMinDistance2_m2);
    }
    if (priority < tau) continue;
    ++statistics_.wanted;
    if (upper_bounds_.is_retested(one.number) &&
        OcclusionUpperBounds::bound_of(entry.step) * priority < tau)
      ++found_by_retest;
    // A chosen source is mixed as if its weight were at least tau.
    const double weight = priority * static_cast<double>(one.source->u);
    const auto age = std::min(keyframe_ - entry.estimated, kMaxAge_keyframes);
    if (!is_current(entry, *one.source))
      refresh_.tasks.stale.push_back({std::max(weight, tau) * age, index, one.source});
    else if (entry.precision < VisibilityPrecision::kFine && !may_share(entry) &&
             (is_partial(entry.diffracted) || (entry.is_direct && !entry.line_is_free)))
      refresh_.tasks.partial.push_back({priority, index, one.source});
  }
  statistics_.current = statistics_.wanted - refresh_.tasks.stale.size();
  // A new source's line test takes two rays.
  if (!all && phase == upper_bounds_.phase())
    upper_bounds_.adapt_phases(found_by_retest,
                               static_cast<std::size_t>(options_.rays_per_keyframe / 2));
}

bool VisibilityCache::refresh(std::span<const Wanted> wanted, double tau) {
  Tasks& tasks = refresh_.tasks;
  tasks.stale.clear();
  tasks.partial.clear();
  const bool all = scene_changed();
  refresh_.last_change_clock +=
      kChangeClockRate * (grid_.change_clock() - refresh_.last_change_clock);
  const std::uint32_t phases = upper_bounds_.phases();
  constexpr std::uint32_t kPhases = OcclusionUpperBounds::kPhases;
  for (std::uint32_t p = 0; p < kPhases && tasks.empty(); ++p)
    collect_tasks(wanted, tau, (upper_bounds_.phase() + p) % kPhases, all);
  // Occluded sources are tested in their phase only, so idle means idle in every phase.
  if (tasks.empty()) return ++refresh_.idle_keyframes < phases;
  refresh_.idle_keyframes = 0;
  work_on(tasks);
  PredictionError& error = refresh_.prediction_error;
  if (error.count > kMinPredictions) {
    grid_.invalidate_on_change(error.sum / error.count);
    error = {};
  }
  return true;
}

void VisibilityCache::work_on(Tasks& tasks) {
  retest_lines(tasks.stale);
  estimate_most_urgent(tasks.stale, VisibilityPrecision::kMedium);
  estimate_most_urgent(tasks.partial, VisibilityPrecision::kFine);
}

void VisibilityCache::renew_at(const Vec3& place, std::span<const Wanted> sources) {
  is_at_rest_ = place == place_;
  place_ = place;
  ++keyframe_;
  if (options_.exact) {
    estimate_now(sources);
    return;
  }
  rays_left_ = options_.rays_per_keyframe / 4;
  Tasks& tasks = refresh_.tasks;
  tasks.stale.clear();
  tasks.partial.clear();
  collect_tasks(sources, 0, 0, true);
  work_on(tasks);
}

// Repeats the line tests of the sources that were updated the longest ago. An image has no line to
// test: it waits for a new estimate.
void VisibilityCache::retest_lines(std::vector<Task>& tasks) {
  const auto count = static_cast<std::size_t>(
      std::clamp<std::int64_t>(std::min<std::int64_t>(options_.rays_per_keyframe / 4, rays_left_),
                               0, static_cast<std::int64_t>(tasks.size())));
  const auto is_older = [this](const Task& a, const Task& b) {
    return entries_[a.index].updated < entries_[b.index].updated;
  };
  if (count < tasks.size())
    std::nth_element(tasks.begin(), tasks.begin() + static_cast<std::ptrdiff_t>(count), tasks.end(),
                     is_older);
  const RayTimer time(statistics_.ray_ms);
  for (std::size_t t = 0; t < count && rays_left_ > 0; ++t) {
    VisibilityEntry& entry = entries_[tasks[t].index];
    if (entry.is_image) continue;
    if (entry.is_stale || !is_within(entry, *tasks[t].source, kRecentRadii))
      test_line(entry, *tasks[t].source);
  }
}

// Estimates the most urgent sources that have no such estimate of this keyframe, as long as there
// are rays.
void VisibilityCache::estimate_most_urgent(std::vector<Task>& tasks,
                                           VisibilityPrecision precision) {
  const auto count = static_cast<std::size_t>(std::clamp<std::int64_t>(
      rays_left_ / kRaysPerTask, 0, static_cast<std::int64_t>(tasks.size())));
  const auto comes_first = [](const Task& a, const Task& b) {
    return a.urgency != b.urgency ? a.urgency > b.urgency : a.index < b.index;
  };
  const auto end = tasks.begin() + static_cast<std::ptrdiff_t>(count);
  if (end != tasks.end()) std::nth_element(tasks.begin(), end, tasks.end(), comes_first);
  std::sort(tasks.begin(), end, comes_first);
  const RayTimer time(statistics_.ray_ms);
  for (std::size_t t = 0; t < count && rays_left_ > kMinRaysForEstimate; ++t) {
    VisibilityEntry& entry = entries_[tasks[t].index];
    if (entry.precision >= precision && entry.updated == keyframe_) continue;
    estimate(entry, *tasks[t].source, precision);
  }
}

}  // namespace clamor
