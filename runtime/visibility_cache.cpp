#include "runtime/visibility_cache.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "runtime/fresnel_visibility.h"

namespace clamor {

namespace {

constexpr double kCellOfDistance = 1.0 / 24, kLeastCell_m = 0.1, kMostCell_m = 0.4;
constexpr std::uint32_t kForget_keyframes = 1500;  // half a minute
constexpr std::size_t kFirstTable = 1 << 12;
// Rays of a first look, about: enough must be left to begin one.
constexpr std::int64_t kRaysOfLook = 50;

std::size_t hash_of(std::uint64_t number) {
  number *= 0x9e3779b97f4a7c15u;
  return static_cast<std::size_t>(number ^ (number >> 32));
}

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
      table_(kFirstTable) {}

void VisibilityCache::begin_keyframe(const Vec3& place) {
  place_ = place;
  ++keyframe_;
  rays_left_ = options_.rays_per_keyframe;
}

bool VisibilityCache::is_current(const Entry& entry) const {
  const Vec3 moved = place_ - Vec3(entry.from_m);
  return dot(moved, moved) <= static_cast<double>(entry.cell_m) * entry.cell_m;
}

VisibilityCache::Entry* VisibilityCache::find(std::uint64_t number) {
  for (std::size_t at = hash_of(number);; ++at) {
    Entry& entry = table_[at & (table_.size() - 1)];
    if (entry.depth == Depth::kNone) return nullptr;
    if (entry.number != number) continue;
    entry.used = keyframe_;
    return &entry;
  }
}

VisibilityCache::Entry& VisibilityCache::find_or_add(std::uint64_t number) {
  if (Entry* const entry = find(number)) return *entry;
  if (2 * (entries_ + 1) > table_.size()) grow();
  std::size_t at = hash_of(number);
  while (table_[at & (table_.size() - 1)].depth != Depth::kNone) ++at;
  Entry& entry = table_[at & (table_.size() - 1)];
  entry.number = number;
  entry.used = keyframe_;
  ++entries_;
  return entry;
}

// Forgets those that have not mattered for long; doubles where that is not enough.
void VisibilityCache::grow() {
  std::vector<Entry> old = std::exchange(table_, {});
  std::erase_if(old, [&](const Entry& entry) {
    return entry.depth == Depth::kNone || keyframe_ - entry.used > kForget_keyframes;
  });
  std::size_t size = kFirstTable;
  while (size < 4 * old.size()) size *= 2;
  table_.assign(size, Entry{});
  entries_ = old.size();
  for (const Entry& entry : old) {
    std::size_t at = hash_of(entry.number);
    while (table_[at & (size - 1)].depth != Depth::kNone) ++at;
    table_[at & (size - 1)] = entry;
  }
}

void VisibilityCache::look_at(Entry& entry, const Source& source, Depth depth) {
  std::uint64_t rays = 0;
  const auto start = std::chrono::steady_clock::now();
  if (depth == Depth::kGlance) {
    rays = 2;
    const auto start_m = geometry_.start(source);
    const bool free = start_m && geometry_.is_free(*start_m, Vec3f(place_));
    entry.known.visibility = same_in_all_bands(free ? 1 : 0);
    ++statistics_.glances;
  } else {
    const bool close = depth == Depth::kClose;
    entry.known.visibility = source_visibility(geometry_, speed_of_sound_mps_, source, place_,
                                               close ? kCloseLookWays : kFirstLookWays, rays);
    ++(close ? statistics_.close_looks : statistics_.looks);
  }
  entry.known.hidden = entry.known.visibility == Bands{};
  entry.depth = depth;
  entry.looked = keyframe_;
  entry.from_m = Vec3f(place_);
  entry.cell_m = static_cast<float>(std::clamp(
      kCellOfDistance * length(place_ - Vec3(source.position_m)), kLeastCell_m, kMostCell_m));
  statistics_.rays += rays;
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
  statistics_.casting_ms += took.count();
  rays_left_ -= static_cast<std::int64_t>(rays);
}

const VisibilityCache::Known* VisibilityCache::known(std::uint64_t number) {
  const Entry* const entry = find(number);
  return entry != nullptr ? &entry->known : nullptr;
}

const VisibilityCache::Known* VisibilityCache::look(std::uint64_t number, const Source& source,
                                                    double loudness) {
  if (!options_.exact && rays_left_ < options_.rays_per_keyframe / 2) {
    ++statistics_.late;
    return nullptr;
  }
  Entry& entry = find_or_add(number);
  look_at(entry, source, options_.exact ? Depth::kLook : Depth::kGlance);
  entry.known.loudness = static_cast<float>(loudness);
  return &entry.known;
}

const Bands& VisibilityCache::look_now(std::uint64_t number, const Source& source) {
  Entry& entry = find_or_add(number);
  if (entry.depth < Depth::kLook || !is_current(entry)) look_at(entry, source, Depth::kLook);
  return entry.known.visibility;
}

bool VisibilityCache::refresh(std::span<Wanted> wanted) {
  // What needs a look first, then what needs a close one.
  struct Turn {
    double loudness;
    std::uint32_t looked;
    std::uint32_t which;
  };
  std::vector<Turn> looks, close_looks;
  for (std::uint32_t i = 0; i < wanted.size(); ++i) {
    const Entry* const entry = find(wanted[i].number);
    if (entry == nullptr) continue;
    const Turn turn{wanted[i].loudness, entry->looked, i};
    if (entry->depth < Depth::kLook || !is_current(*entry))
      looks.push_back(turn);
    else if (entry->depth < Depth::kClose && is_partial(entry->known.visibility))
      close_looks.push_back(turn);
  }
  statistics_.wanted = wanted.size();
  statistics_.current = wanted.size() - looks.size();
  if (looks.empty() && close_looks.empty()) return false;

  const auto louder = [](const Turn& a, const Turn& b) { return a.loudness > b.loudness; };
  const auto older = [](const Turn& a, const Turn& b) {
    return a.looked != b.looked ? a.looked < b.looked : a.loudness > b.loudness;
  };
  // In order, until only `spare` rays are left; those that were served go.
  const auto serve = [&](std::vector<Turn>& turns, const auto& before, Depth depth,
                         std::int64_t spare) {
    const auto most = static_cast<std::size_t>(std::clamp<std::int64_t>(
        (rays_left_ - spare) / 20, 0, static_cast<std::int64_t>(turns.size())));
    std::partial_sort(turns.begin(), turns.begin() + static_cast<std::ptrdiff_t>(most), turns.end(),
                      before);
    std::size_t served = 0;
    for (; served < most && rays_left_ > spare + kRaysOfLook; ++served) {
      const Wanted& one = wanted[turns[served].which];
      look_at(*find(one.number), *one.source, depth);
    }
    turns.erase(turns.begin(), turns.begin() + static_cast<std::ptrdiff_t>(served));
  };
  serve(looks, louder, Depth::kLook, rays_left_ / 4);
  serve(looks, older, Depth::kLook, 0);
  if (looks.empty()) serve(close_looks, louder, Depth::kClose, 0);
  return true;
}

}  // namespace clamor
