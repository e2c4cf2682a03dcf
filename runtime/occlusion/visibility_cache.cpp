#include "runtime/occlusion/visibility_cache.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/occlusion/visibility_estimate.h"
#include "runtime/propagation/source_number.h"
#include "runtime/propagation/tolerances.h"

namespace clamor {

namespace {

using namespace visibility;

int paths_for(VisibilityPrecision precision) {
  return precision == VisibilityPrecision::kFine ? kFinePaths : kMediumPaths;
}

}  // namespace

Bands source_visibility(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                        const Source& source, const Vec3& place, int paths_per_ring,
                        std::uint64_t& rays) {
  ++rays;
  const auto origin_m = geometry.ray_origin(source);
  if (!origin_m) return Bands{};
  const VisibilityEstimate estimate =
      estimate_visibility(geometry, source, {*origin_m, Vec3f(place), speed_of_sound_mps},
                          paths_per_ring, source.is_emitter);
  rays += estimate.rays;
  return estimate.diffracted;
}

bool is_partial(const Bands& visibility) {
  return std::any_of(visibility.begin(), visibility.end(),
                     [](float share) { return share > 0 && share != 1; });
}

Bands fine_visibility(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                      const Source& source, const Vec3& place) {
  std::uint64_t rays = 0;
  const auto estimate = [&](int paths) {
    return source_visibility(geometry, speed_of_sound_mps, source, place, paths, rays);
  };
  const Bands first = estimate(kMediumPaths);
  if (source.is_emitter) return first;
  return is_partial(first) ? estimate(kFinePaths) : first;
}

VisibilityCache::VisibilityCache(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                                 const VisibilityOptions& options)
    : geometry_(geometry), speed_of_sound_mps_(speed_of_sound_mps), options_(options) {}

void VisibilityCache::begin_keyframe(const Vec3& place) {
  is_at_rest_ = keyframe_ == 0 || place == place_;
  if (!is_at_rest_) refresh_.idle_keyframes = 0;
  place_ = place;
  upper_bounds_.begin_keyframe(scene_changed());
  ++keyframe_;
  // Behind a door, all sources are new and audible in the same keyframe.
  const bool doubled = scene_changed() || has_changed_parts();
  rays_left_ = (doubled ? 2 : 1) * std::int64_t{options_.rays_per_keyframe};
  if (entries_.is_crowded()) remove_unused();
  if (has_changed_parts()) mark_stale();
}

// Returns whether a source takes its neighbours' estimate where there is one. An exact cache shares
// those of direct sounds, whose edges cost the most, also while the listener is at rest.
bool VisibilityCache::may_share(const VisibilityEntry& entry) const {
  return entry.share < (entry.is_direct ? kSignificantShare : kSignificantReflection) &&
         !entry.is_image && (!is_at_rest_ || (options_.exact && entry.is_direct));
}

// --- Entries ------------------------------------------------------------------------------------

// Returns whether the listener, and a moving source, are within so many validity radii of where
// they were.
bool VisibilityCache::is_within(const VisibilityEntry& entry, const Source& source,
                                double radii) const {
  const double limit_m = radii * entry.validity_radius_m;
  if (is_moving_source(entry.number) &&
      length(Vec3(source.position_m) - Vec3(entry.origin_m)) > limit_m)
    return false;
  const Vec3 moved_m = place_ - Vec3(entry.listener_m);
  return dot(moved_m, moved_m) <= limit_m * limit_m;
}

bool VisibilityCache::is_current(const VisibilityEntry& entry, const Source& source) const {
  if (entry.precision < VisibilityPrecision::kMedium || entry.estimate_is_stale ||
      (entry.is_shared && !may_share(entry)))
    return false;
  const double changes = grid_.change_clock() - static_cast<double>(entry.change_clock);
  return is_within(entry, source, changes < 0.5 ? 1 : 0);
}

VisibilityCache::Index VisibilityCache::find_current(std::uint64_t number, const Source& source,
                                                     float share) {
  const Index index = find(number);
  if (index == kUnknown) return kUnknown;
  VisibilityEntry& entry = entries_[index];
  entry.used = keyframe_;
  entry.share = share;
  return is_current(entry, source) ? index : kUnknown;
}

VisibilityCache::Index VisibilityCache::add(std::uint64_t number, const Source& source) {
  const Index index = entries_.add(number);
  VisibilityEntry& entry = entries_[index];
  entry.used = keyframe_;
  entry.is_direct = !source.is_image && (source.is_emitter || is_moving_source(number));
  entry.is_image = source.is_image;
  const auto origin_m = geometry_.ray_origin(source);
  entry.has_origin = origin_m.has_value();
  if (origin_m) entry.origin_m = *origin_m;
  return index;
}

void VisibilityCache::remove_unused() {
  upper_bounds_.clear();
  const auto& kept = entries_.remove_unused([&](const VisibilityEntry& entry) {
    return keyframe_ - entry.used > (is_moving_source(entry.number) ? kForgetUnusedMoving_keyframes
                                                                    : kForgetUnused_keyframes);
  });
  std::erase_if(bent_paths_, [this](const auto& one) { return find(one.first) == kUnknown; });
  for (const VisibilityEntry& entry : kept)
    if (entry.step != OcclusionUpperBounds::kUnoccluded && !is_moving_source(entry.number))
      upper_bounds_.set(entry.number, entry.step);
}

// --- Tests and estimates ------------------------------------------------------------------------

// A moving source is at no wall: its rays start where it is.
void VisibilityCache::follow(VisibilityEntry& entry, const Source& source) {
  if (is_moving_source(entry.number)) entry.origin_m = source.position_m;
}

// Derives the visibility and its bounds from the line test and the diffracted power.
void VisibilityCache::update(VisibilityEntry& entry, const Source& source) {
  entry.visibility = entry.diffracted;
  const bool is_moving = is_moving_source(entry.number);
  if (!entry.line_is_free && entry.has_origin &&
      (is_moving ? geometry_.transmits() : geometry_.parts_transmit())) {
    std::uint64_t rays = 0;
    const Bands through =
        is_moving ? geometry_.transmission(entry.origin_m, Vec3f(place_), rays)
                  : geometry_.transmission_of_parts(entry.origin_m, Vec3f(place_), rays);
    for (std::size_t b = 0; b < kBandCount; ++b)
      entry.visibility[b] += std::max(0.0f, 1 - entry.diffracted[b]) * through[b];
    statistics_.rays += rays;
    rays_left_ -= static_cast<std::int64_t>(rays);
  }
  entries_.set_occluded(entry, entry.visibility == Bands{});
  const std::uint8_t step = OcclusionUpperBounds::step_for(
      *std::max_element(entry.visibility.begin(), entry.visibility.end()));
  if (step != entry.step && !is_moving) upper_bounds_.set(entry.number, step);
  entry.step = step;
  entry.updated = keyframe_;
  entry.change_clock = static_cast<float>(grid_.change_clock());
  entry.listener_m = Vec3f(place_);
  const float factor =
      is_partial(entry.diffracted)
          ? std::clamp(kPartialFactorTimesShare / entry.share, kMinPartialFactor, 1.0f)
          : 1.0f;
  entry.validity_radius_m =
      static_cast<float>(static_cast<double>(factor) *
                         std::clamp(kRadiusPerDistance * length(place_ - Vec3(source.position_m)),
                                    kMinRadius_m, kMaxRadius_m));
}

void VisibilityCache::test_line(VisibilityEntry& entry, const Source& source) {
  if (source.is_image) return estimate(entry, source, VisibilityPrecision::kFine);
  const bool was_free = entry.line_is_free;
  follow(entry, source);
  if (may_share(entry) && share_estimate(entry, source)) return;
  entry.line_is_free = is_free(entry);
  // Direct sound over edges keeps its estimate for as long as the line stays as it was.
  if (entry.is_over_edges && entry.line_is_free != was_free)
    return estimate(entry, source, VisibilityPrecision::kFine);
  entry.precision = VisibilityPrecision::kLineTest;
  entry.is_stale = false;
  predict(entry, source, entry.updated == 0 || entry.line_is_free != was_free);
  update(entry, source);
}

// Returns whether the straight line to the listener is free.
bool VisibilityCache::is_free(const VisibilityEntry& entry) {
  ++statistics_.line_tests;
  ++statistics_.rays;
  --rays_left_;
  return entry.has_origin && geometry_.is_free(entry.origin_m, Vec3f(place_));
}

// Gives a source the mean estimate of its neighbours with a straight line like its own.
// Returns false where they have none that is valid here.
bool VisibilityCache::share_estimate(VisibilityEntry& entry, const Source& source) {
  OcclusionGrid::Mean mean;
  const bool line_is_free = is_free(entry);
  if (!entry.has_origin ||
      !grid_.mean(source, place_, line_is_free, OcclusionGrid::Reach::kCell, mean) ||
      (entry.estimate_is_stale && mean.keyframe < parts_keyframe_))
    return false;
  entry.line_is_free = line_is_free;
  entry.diffracted = mean.visibility;
  entry.precision = VisibilityPrecision::kFine;
  entry.is_shared = true;
  entry.is_over_edges = entry.is_stale = entry.estimate_is_stale = false;
  entry.estimated = keyframe_;
  share_path(entry, mean.number);
  update(entry, source);
  return true;
}

// Sound takes the same way as a neighbour's, with the difference of the straight lines in length.
void VisibilityCache::share_path(const VisibilityEntry& entry, std::uint64_t neighbour) {
  const auto path = bent_paths_.find(neighbour);
  const Index index = find(neighbour);
  if (entry.line_is_free || path == bent_paths_.end() || index == kUnknown) {
    bent_paths_.erase(entry.number);
    return;
  }
  const auto straight_m = [this](const VisibilityEntry& of) {
    return length(Vec3(of.origin_m) - place_);
  };
  const Vec3 away_m = Vec3(path->second.heard_at_m) - place_;
  const double path_m = length(away_m),
               own_m = path_m + straight_m(entry) - straight_m(entries_[index]);
  BentPath own = path->second;
  if (path_m > 0 && own_m > 0) own.heard_at_m = Vec3f(place_ + own_m / path_m * away_m);
  bent_paths_.insert_or_assign(entry.number, own);
}

// Takes the neighbours' mean where that is newer than the source's own estimate. Without
// neighbours, the straight line alone decides.
void VisibilityCache::predict(VisibilityEntry& entry, const Source& source, bool line_changed) {
  OcclusionGrid::Mean mean;
  const auto is_known = [&] {
    const auto reach = entry.line_is_free || !entry.occluded ? OcclusionGrid::Reach::kAfar
                                                             : OcclusionGrid::Reach::kNear;
    return grid_.mean(source, place_, entry.line_is_free, reach, mean) &&
           !(entry.estimate_is_stale && mean.keyframe < parts_keyframe_);
  };
  if (entry.is_over_edges) return;
  if (!entry.has_origin) {
    entry.diffracted = {};
  } else if (!is_known()) {
    if (line_changed) entry.diffracted = same_in_all_bands(entry.line_is_free ? 1 : 0);
  } else if (mean.keyframe > entry.estimated) {
    const float rate = line_changed ? 1 : kPredictionRate;
    for (std::size_t b = 0; b < kBandCount; ++b)
      entry.diffracted[b] += rate * (mean.visibility[b] - entry.diffracted[b]);
  }
}

// A direct sound that was heard over edges, or is to be fine, takes the edges into account. One of
// many shares the estimate of one of its neighbours, which is fine.
void VisibilityCache::estimate(VisibilityEntry& entry, const Source& source,
                               VisibilityPrecision precision) {
  follow(entry, source);
  if (may_share(entry)) {
    if (share_estimate(entry, source)) return;
    precision = entry.is_direct ? VisibilityPrecision::kFine : VisibilityPrecision::kMedium;
  }
  const bool is_over_edges =
      entry.is_direct && (entry.is_over_edges || precision == VisibilityPrecision::kFine);
  if (is_over_edges || entry.is_image) precision = VisibilityPrecision::kFine;
  const VisibilityEstimate estimate =
      entry.has_origin
          ? estimate_visibility(geometry_, source, line_to(entry),
                                is_over_edges ? kMediumPaths : paths_for(precision), is_over_edges)
          : VisibilityEstimate();
  store(entry, source, precision, estimate);
}

LineOfSight VisibilityCache::line_to(const VisibilityEntry& entry) const {
  return {entry.origin_m, Vec3f(place_), speed_of_sound_mps_};
}

// What is transmitted straight through walls takes its share of the path.
std::optional<BentPath> VisibilityCache::bent_path(Index known) const {
  const VisibilityEntry& entry = entries_[known];
  if (!entry.is_direct && !entry.is_image) return std::nullopt;
  const auto found = bent_paths_.find(entry.number);
  if (found == bent_paths_.end()) return std::nullopt;
  const double bent = sum_of(entry.diffracted), all = sum_of(entry.visibility);
  return all > 0 ? std::optional(blend(line_to(entry), found->second, bent / all)) : std::nullopt;
}

void VisibilityCache::store(VisibilityEntry& entry, const Source& source,
                            VisibilityPrecision precision, const VisibilityEstimate& estimate) {
  const Bands predicted = std::exchange(entry.diffracted, estimate.diffracted);
  const bool was_stale = entry.estimate_is_stale;
  entry.is_stale = entry.estimate_is_stale = entry.is_shared = false;
  const bool was_predicted = !was_stale && entry.updated > 0 &&
                             grid_.change_clock() - static_cast<double>(entry.change_clock) < 0.5;
  entry.line_is_free = estimate.line_is_free;
  entry.is_over_edges = estimate.is_over_edges;
  if (estimate.bent)
    bent_paths_.insert_or_assign(entry.number, *estimate.bent);
  else if (entry.is_direct || entry.is_image)
    bent_paths_.erase(entry.number);
  ++(precision == VisibilityPrecision::kFine ? statistics_.fine_estimates : statistics_.estimates);
  statistics_.rays += estimate.rays;
  rays_left_ -= static_cast<std::int64_t>(estimate.rays);
  entry.precision = precision;
  entry.estimated = keyframe_;
  update(entry, source);
  if ((entry.is_direct && precision != VisibilityPrecision::kFine) || !entry.has_origin ||
      entry.is_image)
    return;
  grid_.add(entry.number, source, place_, entry.line_is_free, entry.diffracted, keyframe_,
            was_stale ? parts_keyframe_ : 0);
  if (!was_predicted || entry.is_over_edges) return;
  ++refresh_.prediction_error.count;
  for (std::size_t b = 0; b < kBandCount; ++b)
    refresh_.prediction_error.sum +=
        static_cast<double>(std::abs(entry.diffracted[b] - predicted[b])) / kBandCount;
}

VisibilityCache::Index VisibilityCache::test_new(std::uint64_t number, const Source& source,
                                                 double priority, float share) {
  if (rays_left_ < options_.rays_per_keyframe / 2) {
    ++statistics_.late;
    return kUnknown;
  }
  const Index index = add(number, source);
  VisibilityEntry& entry = entries_[index];
  entry.share = share;
  ++statistics_.rays;
  --rays_left_;
  test_line(entry, source);
  const Vec3 path_m = place_ - Vec3(source.position_m);
  entry.priority_at_1m = static_cast<float>(priority * dot(path_m, path_m));
  return entry.occluded ? index | VisibilityEntries::kOccluded : index;
}

const Bands& VisibilityCache::estimate_now(std::uint64_t number, const Source& source) {
  Index index = find(number);
  const bool known = index != kUnknown;
  if (!known) index = add(number, source);
  VisibilityEntry& entry = entries_[index];
  if (!known || !is_current(entry, source))
    estimate(entry, source,
             entry.is_direct ? VisibilityPrecision::kFine : VisibilityPrecision::kMedium);
  return entry.visibility;
}

std::vector<Bands> VisibilityCache::estimate_now(std::span<const Wanted> sources) {
  const auto is_in_batch = [this](const VisibilityEntry& entry) {
    return entry.has_origin && !entry.is_image && !may_share(entry);
  };
  std::vector<Index> indices;               // of entries, by source
  std::vector<std::size_t> needs_estimate;  // which of the sources
  std::vector<LineOfSight> lines;
  for (const Wanted& one : sources) {
    const Index known = find(one.number);
    indices.push_back(known == kUnknown ? add(one.number, *one.source) : known);
    VisibilityEntry& entry = entries_[indices.back()];
    entry.share = one.share;
    if (known != kUnknown && is_current(entry, *one.source)) continue;
    follow(entry, *one.source);
    needs_estimate.push_back(indices.size() - 1);
    if (is_in_batch(entry))
      lines.push_back(entry.is_direct ? either_way(line_to(entry)) : line_to(entry));
  }
  const std::vector<VisibilityEstimate> estimates =
      estimate_visibilities(geometry_, lines, kMediumPaths);
  std::size_t next = 0;
  for (const std::size_t s : needs_estimate) {
    VisibilityEntry& entry = entries_[indices[s]];
    if (!is_in_batch(entry)) {
      estimate(entry, *sources[s].source, VisibilityPrecision::kFine);
      continue;
    }
    VisibilityEstimate estimate = estimates[next++];
    if (entry.is_direct) add_edges(geometry_, line_to(entry), estimate);
    store(entry, *sources[s].source,
          entry.is_direct ? VisibilityPrecision::kFine : VisibilityPrecision::kMedium, estimate);
  }
  std::vector<Bands> visible;
  for (const Index index : indices) visible.push_back(entries_[index].visibility);
  return visible;
}

}  // namespace clamor
