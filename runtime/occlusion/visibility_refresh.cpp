// visibility_refresh.cpp: what a VisibilityCache looks at again, and in which order.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "runtime/occlusion/ray_timer.h"
#include "runtime/occlusion/visibility_cache.h"

namespace clamor {

namespace {

// Rays of a first look, about: enough must be left to begin one.
constexpr std::int64_t kRaysOfLook = 50;
constexpr std::uint32_t kLongAgo_keyframes = 50;
constexpr int kEnoughForSurprise = 20;  // looks
constexpr std::size_t kFetchAhead = 24;

}  // namespace

// Those whose turn it is, or all; those that nothing need be done for are left out.
void VisibilityCache::gather(std::span<const Wanted> wanted, double tau, std::uint32_t turn,
                             bool all) {
  statistics_.wanted = 0;
  std::size_t only_asked = 0;
  double sum = 0;
  in_turn_.clear();
  for (std::uint32_t w = 0; w < wanted.size(); ++w)
    if (all || OcclusionUpperBounds::turn_of(wanted[w].number) == turn) in_turn_.push_back(w);
  for (std::size_t i = 0; i < in_turn_.size(); ++i) {
    if (i + kFetchAhead < in_turn_.size())
      __builtin_prefetch(&entries_[wanted[in_turn_[i + kFetchAhead]].index & ~kHidden], 1);
    const Wanted& one = wanted[in_turn_[i]];
    const Index index = one.index & ~kHidden;
    Entry& entry = entries_[index];
    entry.used = keyframe_;
    double loudness = one.loudness;
    if (entry.hidden) {
      const Vec3 way = place_ - Vec3(one.source->position_m);
      loudness = static_cast<double>(entry.reach) / std::max(dot(way, way), 1e-2);
    }
    if (loudness < tau) continue;
    ++statistics_.wanted;
    if (hidden_.counts_in_full(one.number) &&
        OcclusionUpperBounds::share_of(entry.step) * loudness < tau)
      ++only_asked;
    // A chosen source is mixed as if its weight were tau at least.
    const double weight = loudness * static_cast<double>(one.source->u);
    const bool alone = weight > 4 * std::max(tau, mean_weight_);
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
  // Two for each ray of a glance.
  if (!all && turn == hidden_.turn())
    hidden_.took(only_asked, static_cast<std::size_t>(options_.rays_per_keyframe / 2));
}

bool VisibilityCache::refresh(std::span<const Wanted> wanted, double tau) {
  turns_.clear();
  look_turns_.clear();
  close_turns_.clear();
  const bool all = everything_changed();
  last_change_clock_ += 0.25 * (cells_.change_clock() - last_change_clock_);
  const auto idle = [this] {
    return turns_.empty() && look_turns_.empty() && close_turns_.empty();
  };
  const std::uint32_t turns = hidden_.turns();
  constexpr std::uint32_t kTurns = OcclusionUpperBounds::kTurns;
  for (std::uint32_t t = 0; t < kTurns && idle(); ++t)
    gather(wanted, tau, (hidden_.turn() + t) % kTurns, all);
  // Of those that are hidden nothing is heard but in their turn.
  if (idle()) return ++idle_ < turns;
  idle_ = 0;
  glance_again(turns_);
  serve(turns_, Depth::kQuick);
  serve(look_turns_, Depth::kLook);
  serve(close_turns_, Depth::kClose);
  if (expected_ > kEnoughForSurprise) {
    cells_.invalidate_on_change(surprise_ / expected_);
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
  const RayTimer time(statistics_.ray_ms);
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
  const auto first = [](const Turn& a, const Turn& b) {
    return a.urgency != b.urgency ? a.urgency > b.urgency : a.index < b.index;
  };
  const auto end = turns.begin() + static_cast<std::ptrdiff_t>(most);
  if (end != turns.end()) std::nth_element(turns.begin(), end, turns.end(), first);
  std::sort(turns.begin(), end, first);
  const RayTimer time(statistics_.ray_ms);
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
