#include "runtime/visibility_cache.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/thread_time.h"
#include "runtime/fresnel_visibility.h"
#include "runtime/source_number.h"

namespace clamor {

namespace {

constexpr double kCellOfDistance = 1.0 / 24, kLeastCell_m = 0.1, kMostCell_m = 0.4;
constexpr std::uint32_t kForget_keyframes = 1500;  // half a minute
constexpr std::size_t kFirstTable = 1 << 12;
// Rays of a first look, about: enough must be left to begin one.
constexpr std::int64_t kRaysOfLook = 50;
constexpr std::uint32_t kLongAgo_keyframes = 50;
constexpr int kEnoughForSurprise = 20;  // looks
// A keyframe thinks of every fourth source only.
constexpr std::uint32_t kTurns = 4;

std::size_t hash_of(std::uint64_t number) {
  number *= 0x9e3779b97f4a7c15u;
  return static_cast<std::size_t>(number ^ (number >> 32));
}

// Of this thread, whatever others do.
class CastingTime {
 public:
  explicit CastingTime(double& sum_ms) : sum_ms_(sum_ms), start_s_(thread_time_s()) {}
  ~CastingTime() { sum_ms_ += 1e3 * (thread_time_s() - start_s_); }
  CastingTime(const CastingTime&) = delete;
  CastingTime& operator=(const CastingTime&) = delete;

 private:
  double& sum_ms_;
  const double start_s_;
};

}  // namespace

Bands source_visibility(const SightGeometry& geometry, double speed_of_sound_mps,
                        const Source& source, const Vec3& place, int ways_per_ring,
                        std::uint64_t& rays) {
  ++rays;
  const auto start_m = geometry.start(source);
  if (!start_m) return Bands{};
  return fresnel_visibility(geometry, {*start_m, Vec3f(place), speed_of_sound_mps}, ways_per_ring,
                            rays);
}

bool is_partial(const Bands& visibility) {
  return std::any_of(visibility.begin(), visibility.end(),
                     [](float share) { return share > 0 && share < 1; });
}

Bands look_closely(const SightGeometry& geometry, double speed_of_sound_mps, const Source& source,
                   const Vec3& place) {
  std::uint64_t rays = 0;
  const auto look = [&](int ways) {
    return source_visibility(geometry, speed_of_sound_mps, source, place, ways, rays);
  };
  const Bands first = look(kFirstLookWays);
  return is_partial(first) ? look(kCloseLookWays) : first;
}

VisibilityCache::VisibilityCache(const SightGeometry& geometry, double speed_of_sound_mps,
                                 const VisibilityOptions& options)
    : geometry_(geometry),
      speed_of_sound_mps_(speed_of_sound_mps),
      options_(options),
      slots_(kFirstTable) {}

void VisibilityCache::begin_keyframe(const Vec3& place) {
  place_ = place;
  ++keyframe_;
  rays_left_ = options_.rays_per_keyframe;
  if (4 * entries_.size() > slots_.size()) make_room();
}

// --- Where sources are kept ---------------------------------------------------------------------

bool VisibilityCache::is_within(const Entry& entry, const Source& source, double cells) const {
  const double most_m = cells * entry.cell_m;
  if (is_of_moving(entry.number) && length(Vec3(source.position_m) - Vec3(entry.start_m)) > most_m)
    return false;
  const Vec3 moved = place_ - Vec3(entry.from_m);
  return dot(moved, moved) <= most_m * most_m;
}

bool VisibilityCache::is_current(const Entry& entry, const Source& source) const {
  if (entry.depth < Depth::kQuick) return false;
  const double since = cells_.surprises() - static_cast<double>(entry.surprises);
  return is_within(entry, source, since < 0.5 ? 1 : 0);
}

void VisibilityCache::prefetch(std::uint64_t number) const {
  __builtin_prefetch(&slots_[hash_of(number) & (slots_.size() - 1)]);
}

VisibilityCache::Slot& VisibilityCache::slot_of(std::uint64_t number) {
  for (std::size_t at = hash_of(number);; ++at) {
    Slot& slot = slots_[at & (slots_.size() - 1)];
    if (slot.index == kUnknown || slot.number == number) return slot;
  }
}

VisibilityCache::Index VisibilityCache::find(std::uint64_t number) const {
  return const_cast<VisibilityCache*>(this)->slot_of(number).index;
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
  std::erase_if(entries_,
                [&](const Entry& entry) { return keyframe_ - entry.used > kForget_keyframes; });
  std::size_t size = kFirstTable;
  while (size < 4 * entries_.size() + 4) size *= 2;
  slots_.assign(size, Slot{});
  for (Index i = 0; i < entries_.size(); ++i) {
    const std::uint64_t number = entries_[i].number;
    slot_of(number) = {number, i | (entries_[i].hidden ? kHidden : 0)};
  }
}

// --- Looking ------------------------------------------------------------------------------------

// One that moves has no wall that its rays would leave from.
void VisibilityCache::follow(Entry& entry, const Source& source) {
  if (is_of_moving(entry.number)) entry.start_m = source.position_m;
}

// The straight line and the ways round it are known: so is what arrives.
void VisibilityCache::seen(Entry& entry, const Source& source) {
  entry.visibility = entry.around;
  if (is_of_moving(entry.number) && !entry.straight && geometry_.lets_through()) {
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
  entry.changed = keyframe_;
  entry.surprises = static_cast<float>(cells_.surprises());
  entry.from_m = Vec3f(place_);
  entry.cell_m = static_cast<float>(std::clamp(
      kCellOfDistance * length(place_ - Vec3(source.position_m)), kLeastCell_m, kMostCell_m));
}

void VisibilityCache::glance_at(Entry& entry, const Source& source) {
  const bool was_straight = entry.straight;
  follow(entry, source);
  entry.straight = entry.has_start && geometry_.is_free(entry.start_m, Vec3f(place_));
  entry.depth = Depth::kGlance;
  ++statistics_.glances;
  ++statistics_.rays;
  --rays_left_;
  believe_neighbours(entry, source, entry.changed == 0 || entry.straight != was_straight);
  seen(entry, source);
}

// What is newer than one's own look. One that nothing can be said of is heard or hidden as its
// straight line says.
void VisibilityCache::believe_neighbours(Entry& entry, const Source& source, bool new_side) {
  SightCells::Mean mean;
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
  std::uint64_t rays = 0;
  const Bands believed = std::exchange(entry.around, {});
  follow(entry, source);
  const bool expected =
      entry.changed > 0 && cells_.surprises() - static_cast<double>(entry.surprises) < 0.5;
  entry.straight = false;
  const bool close = depth == Depth::kClose;
  if (entry.has_start)
    entry.around =
        fresnel_visibility(geometry_, {entry.start_m, Vec3f(place_), speed_of_sound_mps_},
                           close                    ? kCloseLookWays
                           : depth == Depth::kQuick ? kQuickLookWays
                                                    : kFirstLookWays,
                           rays, &entry.straight);
  ++(close ? statistics_.close_looks : statistics_.looks);
  statistics_.rays += rays;
  rays_left_ -= static_cast<std::int64_t>(rays);
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
  if (!options_.exact && rays_left_ < options_.rays_per_keyframe / 2) {
    ++statistics_.late;
    return kUnknown;
  }
  const CastingTime time(statistics_.casting_ms);
  const Index index = add(number, source);
  Entry& entry = entries_[index];
  ++statistics_.rays;
  --rays_left_;
  if (options_.exact)
    look_at(entry, source, Depth::kLook);
  else
    glance_at(entry, source);
  const Vec3 way = place_ - Vec3(source.position_m);
  entry.reach = static_cast<float>(loudness * dot(way, way));
  return entry.hidden ? index | kHidden : index;
}

const Bands& VisibilityCache::look_now(std::uint64_t number, const Source& source) {
  Index index = find(number);
  const bool known = index != kUnknown;
  if (!known) index = add(number, source);
  Entry& entry = entries_[index & ~kHidden];
  if (!known || entry.depth < Depth::kLook || !is_current(entry, source))
    look_at(entry, source, Depth::kLook);
  return entry.visibility;
}

// --- Looking again ------------------------------------------------------------------------------

// Those whose turn it is, or all; those that nothing need be done for are left out.
void VisibilityCache::gather(std::span<const Wanted> wanted, double tau, std::uint32_t turn,
                             bool all) {
  statistics_.wanted = 0;
  double sum = 0;
  for (const Wanted& one : wanted) {
    const Index index = one.index & ~kHidden;
    if (!all && index % kTurns != turn) continue;
    Entry& entry = entries_[index];
    entry.used = keyframe_;
    double loudness = one.loudness;
    if (entry.hidden) {
      const Vec3 way = place_ - Vec3(one.source->position_m);
      loudness = static_cast<double>(entry.reach) / std::max(dot(way, way), 1e-2);
    }
    if (loudness < tau) continue;
    ++statistics_.wanted;
    // A chosen source is mixed as if its weight were tau at least.
    const double weight = loudness * static_cast<double>(one.source->u);
    const bool alone = options_.exact || weight > 4 * std::max(tau, mean_weight_);
    sum += weight;
    const double counts = std::max(weight, tau);
    const auto age = std::min(keyframe_ - entry.looked, kLongAgo_keyframes);
    if (!is_current(entry, *one.source))
      turns_.push_back({counts * age, index, one.source, alone});
    else if (entry.depth < Depth::kLook)
      look_turns_.push_back({loudness, index, one.source});
    else if (entry.depth < Depth::kClose && is_partial(entry.around))
      close_turns_.push_back({loudness, index, one.source});
  }
  mean_weight_ = sum / std::max<double>(1, static_cast<double>(statistics_.wanted));
  statistics_.current = statistics_.wanted - turns_.size();
}

bool VisibilityCache::refresh(std::span<const Wanted> wanted, double tau) {
  turns_.clear();
  look_turns_.clear();
  close_turns_.clear();
  const bool all = cells_.surprises() > last_surprises_ + 0.5;
  last_surprises_ += 0.25 * (cells_.surprises() - last_surprises_);
  const auto idle = [this] {
    return turns_.empty() && look_turns_.empty() && close_turns_.empty();
  };
  for (std::uint32_t t = 0; t < kTurns && idle(); ++t)
    gather(wanted, tau, (keyframe_ + t) % kTurns, all);
  if (idle()) return false;
  if (!options_.exact) glance_again(turns_);
  serve(turns_, options_.exact ? Depth::kLook : Depth::kQuick);
  serve(look_turns_, Depth::kLook);
  serve(close_turns_, Depth::kClose);
  if (expected_ > kEnoughForSurprise) {
    cells_.be_surprised(surprise_ / expected_);
    surprise_ = expected_ = 0;
  }
  return true;
}

// Those that were seen the longest ago. What is known of neighbours may have changed where they
// themselves need no glance.
void VisibilityCache::glance_again(std::vector<Turn>& turns) {
  const auto most = static_cast<std::size_t>(
      std::clamp<std::int64_t>(std::min<std::int64_t>(options_.rays_per_keyframe / 4, rays_left_),
                               0, static_cast<std::int64_t>(turns.size())));
  const auto older = [this](const Turn& a, const Turn& b) {
    return entries_[a.index].changed < entries_[b.index].changed;
  };
  if (most < turns.size())
    std::nth_element(turns.begin(), turns.begin() + static_cast<std::ptrdiff_t>(most), turns.end(),
                     older);
  const CastingTime time(statistics_.casting_ms);
  for (std::size_t t = 0; t < most; ++t) {
    Entry& entry = entries_[turns[t].index];
    if (!is_within(entry, *turns[t].source, 0.1)) glance_at(entry, *turns[t].source);
  }
}

// The most urgent first, as long as there are rays; those whose neighbours were just looked at
// last.
void VisibilityCache::serve(std::vector<Turn>& turns, Depth depth) {
  const auto most = static_cast<std::size_t>(
      std::clamp<std::int64_t>(rays_left_ / 10, 0, static_cast<std::int64_t>(turns.size())));
  std::partial_sort(turns.begin(), turns.begin() + static_cast<std::ptrdiff_t>(most), turns.end(),
                    [](const Turn& a, const Turn& b) { return a.urgency > b.urgency; });
  const CastingTime time(statistics_.casting_ms);
  for (const bool again : {false, true})
    for (std::size_t t = 0; t < most && rays_left_ > kRaysOfLook; ++t) {
      Entry& entry = entries_[turns[t].index];
      const Source& source = *turns[t].source;
      if (again ? entry.depth >= depth && entry.changed == keyframe_
                : !turns[t].counts_alone && cells_.is_of(keyframe_, source, place_))
        continue;
      look_at(entry, source, turns[t].counts_alone ? std::max(depth, Depth::kLook) : depth);
    }
}

}  // namespace clamor
