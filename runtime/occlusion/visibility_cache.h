// visibility_cache.h: the visibility of each source from where the listener is, within a budget of
// rays (runtime/README.md, "Visibility and late reflections").
//
// There are three levels of precision (VisibilityPrecision):
//
//   line test  1 ray (2 for a new source): whether the straight line is free. Where the
//              neighbourhood has no estimate that can be shared, the source takes the mean of a
//              larger one.
//   medium     8 paths per ring (fresnel_visibility.h)
//   fine       64 paths per ring, for significant sources that an edge partly occludes; for direct
//              sounds, the medium one and all edges near the path (direct_sound.h); for images,
//              their mirrors and edges (image_path.h)
//
// An estimate is valid within a ball around the listener's position; outside of it a stale one
// stays in use until the source's turn comes. Sources that are no large part of the sum share the
// mean of their neighbours (occlusion_grid.h). Steps beyond line tests of new sources are in
// visibility_refresh.cpp, and what movable parts make stale in visibility_parts.cpp.
//
// An offline render uses an exact cache, which has no budget: its sampler requests an estimate
// (estimate_now) of every source that may be chosen and has none that is valid at the listener's
// position. The budget counts rays and not time, so the result does not depend on the machine's
// load.
//
// Threads: the sampler's alone.   Memory: 140 to 220 bytes per source that mattered recently.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "runtime/occlusion/changed_parts.h"
#include "runtime/occlusion/occlusion_batch.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/occlusion_grid.h"
#include "runtime/occlusion/occlusion_upper_bounds.h"
#include "runtime/occlusion/visibility_entries.h"
#include "runtime/occlusion/visibility_estimate.h"
#include "runtime/occlusion/visibility_options.h"

namespace clamor {

struct VisibilityStatistics {
  std::uint64_t rays = 0, line_tests = 0, estimates = 0, fine_estimates = 0;
  double ray_ms = 0;  // CPU time of the sampler's thread for tests, renewals and refreshes
  // Sources that counted as occluded, or as before a movable part crossed their path, for want of
  // rays.
  std::uint64_t late = 0;
  std::uint64_t wanted = 0;   // sources that mattered in the last keyframe,
  std::uint64_t current = 0;  // and how many of them had a valid estimate
};

// Visibility of a source from `place`; zero where the ray origin is ambiguous
// (occlusion_geometry.h). Adds the rays cast to `rays`.
Bands source_visibility(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                        const Source& source, const Vec3& place, int paths_per_ring,
                        std::uint64_t& rays);

// Returns whether an edge partly occludes the source, so that more rays would refine the estimate.
bool is_partial(const Bands& visibility);

// A visibility from as many rays as it takes, for references.
Bands fine_visibility(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                      const Source& source, const Vec3& place);

class VisibilityCache {
 public:
  // A known source. Valid until the next keyframe.
  using Index = VisibilityEntries::Index;
  static constexpr Index kUnknown = VisibilityEntries::kUnknown;

  // A source that may be chosen, with its priority without occlusion, which may be left out for
  // occluded sources.
  struct Wanted {
    double priority = 0;
    std::uint64_t number = 0;
    Index index = kUnknown;
    const Source* source = nullptr;
    float share = 1;  // of all that is heard, at most, in any band
  };

  // The geometry must outlive the cache.
  VisibilityCache(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                  const VisibilityOptions& options);

  bool exact() const { return options_.exact; }
  // Whether there is anything that occludes, now.
  bool occludes() const { return !geometry_.empty(); }

  // Movable parts have changed within these bounds, before the next keyframe.
  void change_parts(std::span<const PartBounds> bounds) { changed_parts_.add(bounds); }
  bool has_changed_parts() const { return !changed_parts_.empty(); }

  // Sets the listener's position and renews the budget of rays.
  void begin_keyframe(const Vec3& place);

  // Prefetches what find() reads of a source.
  void prefetch(std::uint64_t number) const { entries_.prefetch(number); }
  Index find(std::uint64_t number) const { return entries_.find(number); }
  static bool is_occluded(Index known) { return (known & VisibilityEntries::kOccluded) != 0; }

  // The index of a source with a medium or fine estimate that is valid here, kUnknown otherwise.
  Index find_current(std::uint64_t number, const Source& source, float share);

  // Visibility of a known source.
  const Bands& visibility(Index known) const { return entries_[known].visibility; }
  void prefetch_visibility(Index known) const {
    __builtin_prefetch(&entries_[known]);
    __builtin_prefetch(&visibility(known));
  }

  // How a known direct sound or image reaches the listener around edges; nothing if it comes
  // straight, and for reflections.
  std::optional<BentPath> bent_path(Index known) const;

  // Upper bounds of all visibilities, for pools to cull by in this keyframe.
  const OcclusionUpperBounds& upper_bounds() const { return upper_bounds_; }

  // Returns whether a movable part has crossed the path of a known source since its last test.
  bool is_stale(Index known) const { return entries_[known].is_stale; }
  // Renews the visibilities of stale sources, in their order, as far as there are rays for them.
  // The others keep their visibility, and stay stale.
  void renew(std::span<const Wanted> stale);

  // Line test of an unknown source; kUnknown if no rays are left for new sources.
  Index test_new(std::uint64_t number, const Source& source, double priority, float share = 1);

  // For a RayTimer over many calls of test_new(), each of which is too short to ask a clock.
  double& ray_ms() { return statistics_.ray_ms; }

  // Visibility of a source by an estimate that is valid here, made now if need be and without
  // regard to the budget: for samplers that take every source.
  const Bands& estimate_now(std::uint64_t number, const Source& source);

  // Visibilities of many sources, in their order, estimated on all cores.
  std::vector<Bands> estimate_now(std::span<const Wanted> sources);

  // Spends the remaining rays on a quarter of the sources whose priority without occlusion is at
  // least `tau`. Returns false once there is nothing left to do.
  bool refresh(std::span<const Wanted> wanted, double tau);

  // Between keyframes: renews the estimates of these known sources alone, for a listener who has
  // moved, with a quarter of the rays.
  void renew_at(const Vec3& place, std::span<const Wanted> sources);

  const VisibilityStatistics& statistics() const { return statistics_; }

 private:
  // A source that refresh() may test or estimate.
  struct Task {
    double urgency;
    Index index;
    const Source* source;
  };
  struct Tasks {
    std::vector<Task> stale, partial;  // by what is wrong with their estimates

    bool empty() const { return stale.empty() && partial.empty(); }
  };
  // Sum of the errors of predictions by the grid, until there are enough for a mean.
  struct PredictionError {
    double sum = 0;
    int count = 0;
  };
  struct RefreshState {
    Tasks tasks;
    std::vector<std::uint32_t> in_phase;  // sources wanted that the current phase retests
    PredictionError prediction_error;
    double last_change_clock = 0;
    std::uint32_t idle_keyframes = 0;  // in a row without a task, at this position
  };

  bool may_share(const VisibilityEntry& entry) const;
  bool is_within(const VisibilityEntry& entry, const Source& source, double radii) const;
  bool is_current(const VisibilityEntry& entry, const Source& source) const;
  Index add(std::uint64_t number, const Source& source);
  void remove_unused();
  void follow(VisibilityEntry& entry, const Source& source);
  void update(VisibilityEntry& entry, const Source& source);
  void test_line(VisibilityEntry& entry, const Source& source);
  bool is_free(const VisibilityEntry& entry);
  bool share_estimate(VisibilityEntry& entry, const Source& source);
  void share_path(const VisibilityEntry& entry, std::uint64_t neighbour);
  void predict(VisibilityEntry& entry, const Source& source, bool line_changed);
  void estimate(VisibilityEntry& entry, const Source& source, VisibilityPrecision precision);
  LineOfSight line_to(const VisibilityEntry& entry) const;
  void store(VisibilityEntry& entry, const Source& source, VisibilityPrecision precision,
             const VisibilityEstimate& estimate);
  std::size_t renew_direct(std::span<const Wanted> stale);
  void mark_stale();
  void mark_stale(VisibilityEntry& entry);
  bool scene_changed() const { return grid_.change_clock() > refresh_.last_change_clock + 0.5; }
  void collect_tasks(std::span<const Wanted> wanted, double tau, std::uint32_t phase, bool all);
  void work_on(Tasks& tasks);
  void retest_lines(std::vector<Task>& tasks);
  void estimate_most_urgent(std::vector<Task>& tasks, VisibilityPrecision precision);

  const OcclusionGeometry& geometry_;
  const double speed_of_sound_mps_;
  const VisibilityOptions options_;
  VisibilityEntries entries_;
  OcclusionUpperBounds upper_bounds_;
  OcclusionGrid grid_;
  std::unordered_map<std::uint64_t, BentPath> bent_paths_;  // by source number
  ChangedParts changed_parts_;                              // since the last keyframe
  Vec3 place_{};
  bool is_at_rest_ = false;  // the listener is where it was in the last keyframe, if any
  std::uint32_t keyframe_ = 0;
  std::uint32_t parts_keyframe_ = 0;  // the last in which parts had changed
  std::int64_t rays_left_ = 0;
  VisibilityStatistics statistics_;
  RefreshState refresh_;
};

}  // namespace clamor
