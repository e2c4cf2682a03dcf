#include "runtime/occlusion/visibility_cache.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/fibonacci_hash.h"
#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/ray_timer.h"
#include "runtime/propagation/source_number.h"

namespace clamor {

namespace {

constexpr double kCellOfDistance = 1.0 / 24, kLeastCell_m = 0.1, kMostCell_m = 0.4;
// What an edge cuts changes the fastest.
constexpr double kCellWherePartial = 1.0 / 4;
constexpr std::uint32_t kForgetSources_keyframes = 1500;  // half a minute
constexpr std::size_t kLeastSlots = 1 << 12;

}  // namespace

Bands source_visibility(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                        const Source& source, const Vec3& place, int paths_per_ring,
                        std::uint64_t& rays) {
  ++rays;
  const auto start_m = geometry.start(source);
  if (!start_m) return Bands{};
  return fresnel_visibility(geometry, {*start_m, Vec3f(place), speed_of_sound_mps}, paths_per_ring,
                            rays);
}

bool is_partial(const Bands& visibility) {
  return std::any_of(visibility.begin(), visibility.end(),
                     [](float share) { return share > 0 && share < 1; });
}

Bands fine_visibility(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                      const Source& source, const Vec3& place) {
  std::uint64_t rays = 0;
  const auto look = [&](int ways) {
    return source_visibility(geometry, speed_of_sound_mps, source, place, ways, rays);
  };
  const Bands first = look(kMediumPaths);
  return is_partial(first) ? look(kFinePaths) : first;
}

VisibilityCache::VisibilityCache(const OcclusionGeometry& geometry, double speed_of_sound_mps,
                                 const VisibilityOptions& options)
    : geometry_(geometry),
      speed_of_sound_mps_(speed_of_sound_mps),
      options_(options),
      slots_(kLeastSlots) {}

void VisibilityCache::begin_keyframe(const Vec3& place) {
  if (place != place_) idle_ = 0;
  place_ = place;
  hidden_.begin_keyframe(everything_changed());
  ++keyframe_;
  // Behind a door all is new at once, and it is heard at once.
  rays_left_ = (everything_changed() ? 2 : 1) * std::int64_t{options_.rays_per_keyframe};
  if (4 * entries_.size() > slots_.size()) make_room();
}

// --- Where sources are kept ---------------------------------------------------------------------

bool VisibilityCache::is_within(const Entry& entry, const Source& source, double cells) const {
  const double most_m = cells * entry.cell_m;
  if (is_moving_source(entry.number) &&
      length(Vec3(source.position_m) - Vec3(entry.start_m)) > most_m)
    return false;
  const Vec3 moved = place_ - Vec3(entry.from_m);
  return dot(moved, moved) <= most_m * most_m;
}

bool VisibilityCache::is_current(const Entry& entry, const Source& source) const {
  if (entry.depth < Depth::kQuick) return false;
  const double since = cells_.change_clock() - static_cast<double>(entry.change_clock);
  return is_within(entry, source, since < 0.5 ? 1 : 0);
}

void VisibilityCache::prefetch(std::uint64_t number) const {
  __builtin_prefetch(&slots_[fibonacci_hash(number) & (slots_.size() - 1)]);
}

VisibilityCache::Slot& VisibilityCache::slot_of(std::uint64_t number) {
  for (std::size_t at = fibonacci_hash(number);; ++at) {
    Slot& slot = slots_[at & (slots_.size() - 1)];
    if (slot.index == kUnknown || slot.number == number) return slot;
  }
}

VisibilityCache::Index VisibilityCache::find(std::uint64_t number) const {
  return const_cast<VisibilityCache*>(this)->slot_of(number).index;
}

VisibilityCache::Index VisibilityCache::find_current(std::uint64_t number, const Source& source) {
  const Index index = find(number);
  if (index == kUnknown) return kUnknown;
  Entry& entry = entries_[index & ~kHidden];
  entry.used = keyframe_;
  return entry.depth >= Depth::kLook && is_current(entry, source) ? index : kUnknown;
}

VisibilityCache::Index VisibilityCache::add(std::uint64_t number, const Source& source) {
  const auto index = static_cast<Index>(entries_.size());
  Entry& entry = entries_.emplace_back();
  entry.number = number;
  entry.used = keyframe_;
  const auto start_m = geometry_.start(source);
  entry.has_start = start_m.has_value();
  if (start_m) entry.start_m = *start_m;
  if (2 * entries_.size() > slots_.size()) {
    std::vector<Slot> old(2 * slots_.size());
    slots_.swap(old);
    for (const Slot& slot : old)
      if (slot.index != kUnknown) slot_of(slot.number) = slot;
  }
  slot_of(number) = {number, index};
  return index;
}

// Forgets those that have not mattered for long; indices change.
void VisibilityCache::make_room() {
  std::erase_if(entries_, [&](const Entry& entry) {
    return keyframe_ - entry.used > kForgetSources_keyframes;
  });
  std::size_t size = kLeastSlots;
  while (size < 4 * entries_.size() + 4) size *= 2;
  slots_.assign(size, Slot{});
  hidden_.clear();
  for (Index i = 0; i < entries_.size(); ++i) {
    const std::uint64_t number = entries_[i].number;
    slot_of(number) = {number, i | (entries_[i].hidden ? kHidden : 0)};
    if (entries_[i].step != OcclusionUpperBounds::kHeard && !is_moving_source(number))
      hidden_.set(number, entries_[i].step);
  }
}

// --- Looking ------------------------------------------------------------------------------------

// One that moves has no wall that its rays would leave from.
void VisibilityCache::follow(Entry& entry, const Source& source) {
  if (is_moving_source(entry.number)) entry.start_m = source.position_m;
}

// The straight line and the ways round it are known: so is what arrives.
void VisibilityCache::seen(Entry& entry, const Source& source) {
  entry.visibility = entry.around;
  if (is_moving_source(entry.number) && !entry.straight && geometry_.lets_through()) {
    std::uint64_t rays = 0;
    const Bands through = geometry_.transmission(entry.start_m, Vec3f(place_), rays);
    for (std::size_t b = 0; b < kBandCount; ++b)
      entry.visibility[b] += (1 - entry.around[b]) * through[b];
    statistics_.rays += rays;
    rays_left_ -= static_cast<std::int64_t>(rays);
  }
  if (const bool hidden = entry.visibility == Bands{}; hidden != entry.hidden) {
    entry.hidden = hidden;
    slot_of(entry.number).index ^= kHidden;
  }
  const std::uint8_t step = OcclusionUpperBounds::step_of(
      *std::max_element(entry.visibility.begin(), entry.visibility.end()));
  if (step != entry.step && !is_moving_source(entry.number)) hidden_.set(entry.number, step);
  entry.step = step;
  entry.changed = keyframe_;
  entry.change_clock = static_cast<float>(cells_.change_clock());
  entry.from_m = Vec3f(place_);
  const double partly = is_partial(entry.around) ? kCellWherePartial : 1;
  entry.cell_m = static_cast<float>(
      partly * std::clamp(kCellOfDistance * length(place_ - Vec3(source.position_m)), kLeastCell_m,
                          kMostCell_m));
}

void VisibilityCache::glance_at(Entry& entry, const Source& source) {
  const bool was_straight = entry.straight;
  follow(entry, source);
  entry.straight = entry.has_start && geometry_.is_free(entry.start_m, Vec3f(place_));
  entry.depth = Depth::kGlance;
  ++statistics_.line_tests;
  ++statistics_.rays;
  --rays_left_;
  believe_neighbours(entry, source, entry.changed == 0 || entry.straight != was_straight);
  seen(entry, source);
}

// What is newer than one's own look. One that nothing can be said of is heard or hidden as its
// straight line says.
void VisibilityCache::believe_neighbours(Entry& entry, const Source& source, bool new_side) {
  OcclusionGrid::Mean mean;
  if (!entry.has_start) {
    entry.around = {};
  } else if (!cells_.mean(source, place_, entry.straight, entry.straight || !entry.hidden, mean)) {
    if (new_side) entry.around = same_in_all_bands(entry.straight ? 1 : 0);
  } else if (mean.keyframe > entry.looked) {
    const float share = new_side ? 1 : 0.8f;
    for (std::size_t b = 0; b < kBandCount; ++b)
      entry.around[b] += share * (mean.visibility[b] - entry.around[b]);
  }
}

void VisibilityCache::look_at(Entry& entry, const Source& source, Depth depth) {
  follow(entry, source);
  VisibilityEstimate look;
  if (entry.has_start)
    look.around = fresnel_visibility(geometry_, {entry.start_m, Vec3f(place_), speed_of_sound_mps_},
                                     depth == Depth::kClose   ? kFinePaths
                                     : depth == Depth::kQuick ? kCoarsePaths
                                                              : kMediumPaths,
                                     look.rays, &look.straight);
  looked(entry, source, depth, look);
}

void VisibilityCache::looked(Entry& entry, const Source& source, Depth depth,
                             const VisibilityEstimate& look) {
  const Bands believed = std::exchange(entry.around, look.around);
  const bool expected =
      entry.changed > 0 && cells_.change_clock() - static_cast<double>(entry.change_clock) < 0.5;
  entry.straight = look.straight;
  ++(depth == Depth::kClose ? statistics_.fine_estimates : statistics_.looks);
  statistics_.rays += look.rays;
  rays_left_ -= static_cast<std::int64_t>(look.rays);
  entry.depth = depth;
  entry.looked = keyframe_;
  seen(entry, source);
  if (options_.exact || !entry.has_start) return;
  cells_.add(source, place_, entry.straight, entry.around, keyframe_);
  if (!expected) return;
  ++expected_;
  for (std::size_t b = 0; b < kBandCount; ++b)
    surprise_ += static_cast<double>(std::abs(entry.around[b] - believed[b])) / kBandCount;
}

VisibilityCache::Index VisibilityCache::look(std::uint64_t number, const Source& source,
                                             double loudness) {
  if (rays_left_ < options_.rays_per_keyframe / 2) {
    ++statistics_.late;
    return kUnknown;
  }
  const RayTimer time(statistics_.ray_ms);
  const Index index = add(number, source);
  Entry& entry = entries_[index];
  ++statistics_.rays;
  --rays_left_;
  glance_at(entry, source);
  const Vec3 way = place_ - Vec3(source.position_m);
  entry.reach = static_cast<float>(loudness * dot(way, way));
  return entry.hidden ? index | kHidden : index;
}

const Bands& VisibilityCache::estimate_now(std::uint64_t number, const Source& source) {
  Index index = find(number);
  const bool known = index != kUnknown;
  if (!known) index = add(number, source);
  Entry& entry = entries_[index & ~kHidden];
  if (!known || entry.depth < Depth::kLook || !is_current(entry, source))
    look_at(entry, source, Depth::kLook);
  return entry.visibility;
}

std::vector<Bands> VisibilityCache::estimate_now(std::span<const Wanted> sources) {
  const RayTimer time(statistics_.ray_ms);
  std::vector<Index> indices, looks;  // of entries; of sources
  std::vector<LineOfSight> lines;
  for (const Wanted& one : sources) {
    const Index known = find(one.number);
    indices.push_back(known == kUnknown ? add(one.number, *one.source) : known & ~kHidden);
    Entry& entry = entries_[indices.back()];
    if (known != kUnknown && entry.depth >= Depth::kLook && is_current(entry, *one.source))
      continue;
    follow(entry, *one.source);
    looks.push_back(static_cast<Index>(indices.size() - 1));
    if (entry.has_start) lines.push_back({entry.start_m, Vec3f(place_), speed_of_sound_mps_});
  }
  const std::vector<VisibilityEstimate> along =
      estimate_visibilities(geometry_, lines, kMediumPaths);
  std::size_t next = 0;
  for (const Index i : looks) {
    Entry& entry = entries_[indices[i]];
    looked(entry, *sources[i].source, Depth::kLook,
           entry.has_start ? along[next++] : VisibilityEstimate());
  }
  std::vector<Bands> visible;
  for (const Index index : indices) visible.push_back(entries_[index].visibility);
  return visible;
}

}  // namespace clamor
