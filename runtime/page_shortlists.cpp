#include "runtime/page_shortlists.h"

#include <algorithm>

namespace clamor {

namespace {

constexpr double kGiveOfDistance = 1.0 / 30, kLeastGive_m = 0.1;
constexpr double kHold_s = 0.3;  // and up to twice as long; or twice that
constexpr std::uint32_t kTurns = 16;
constexpr double kWideGiveOfDistance = 1.0 / 8, kLeastWideGive_m = 0.4;
// Lists that were not used for so long are dropped, now and then.
constexpr std::uint32_t kForget_keyframes = 256;

}  // namespace

void PageShortlists::begin(const Vec3& place, double time_s, double loudest, double until_s) {
  const bool back = time_s < time_s_;  // lists hold until later than now, but not from now on
  time_s_ = time_s;
  loudest_ = loudest;
  until_s_ = until_s;
  step_m_ = length(place - place_);
  place_ = place;
  ++keyframe_;
  if (back || keyframe_ % kForget_keyframes == 0) {
    std::erase_if(lists_, [&](const List& list) {
      return back || keyframe_ - list.used > kForget_keyframes;
    });
    rehash(kFirstSlots);
  }
  seen_.clear();
  for (const LoudnessTrack& track : ceilings_.tracks) seen_.push_back(track.seen_at(time_s));
}

void PageShortlists::rehash(std::size_t size) {
  while (size < 4 * lists_.size()) size *= 2;
  slots_.assign(size, 0);
  for (std::size_t l = 0; l < lists_.size(); ++l) {
    std::size_t at = hash_of(lists_[l].first);
    while (slots_[at & (size - 1)] != 0) ++at;
    slots_[at & (size - 1)] = static_cast<std::uint32_t>(l + 1);
  }
}

// Those of a page that `list` must have from now on, as it says where it holds and above what.
template <class Kept>
std::size_t PageShortlists::sift(List& list, const MetPage& page, double away_m, double hold_s,
                                 const Kept& kept) {
  const Vec3 listener =
      page.placement != nullptr ? page.placement->outside(page.place) : page.place;
  const double scale = page.placement != nullptr ? page.placement->scale : 1;
  list.place = page.place;
  list.until_s = seen_.empty() ? until_s_ : std::min(until_s_, time_s_ + hold_s);
  list.give_s =
      static_cast<float>((list.give_m * scale + 1e-3) / field_.speed_of_sound_mps() + 1e-6);
  list.entries.clear();
  list.shapes.clear();
  const SieveGive give{list.give_m, std::max(away_m, 1 / scale)};
  const auto least = static_cast<float>(list.threshold * (1 - 1e-6));
  return page.sources.pass(
      page.place, list.threshold / loudest_,
      [&](std::size_t index, double ceiling, const SievePart& part) {
        const Source& stored = page.sources[index];
        Entry entry{static_cast<float>(ceiling), 0, 0, static_cast<std::uint32_t>(index),
                    field_.late_boost().at(stored.delay_s)};
        if (page.placement == nullptr) {
          entry.delay_s = static_cast<float>(field_.delay_s(stored, listener));
        } else {
          const Source placed = page.placement->place(stored);
          if (placed.emitter >= field_.emitter_count()) return;  // of a forged file
          entry.delay_s = static_cast<float>(field_.delay_s(placed, listener));
        }
        entry.signal = page.maps.signal(page.map, field_.signal(stored));
        if (!seen_.empty() &&
            entry.ceiling * seen_[entry.signal].most_share(entry.delay_s, list.give_s,
                                                           list.until_s - time_s_) <
                least)
          return;
        kept(entry, stored, part);
      },
      give);
}

// One who walks faster than lists hold has no use for their give. A list that was empty most likely
// stays so: then it may hold for longer.
std::size_t PageShortlists::fill(List& list, const MetPage& page) {
  const Vec3 low(page.bounds.low_m), high(page.bounds.high_m);
  const double away_m = length(glm::max(glm::max(low - page.place, page.place - high), Vec3(0)));
  const double scale = page.placement != nullptr ? page.placement->scale : 1;
  const auto give_m = [&](double of_distance, double least_m) {
    return std::min(std::max(of_distance * away_m, least_m / scale), kMostGive_m / scale);
  };
  // Not all at once.
  turn_ = (turn_ + 1) % kTurns;
  const double hold_s = kHold_s * (1 + static_cast<double>(turn_) / kTurns);
  std::size_t looked_at = 0;
  if (list.give_m >= 0 && list.entries.empty()) {
    list.give_m = give_m(kWideGiveOfDistance, kLeastWideGive_m);
    list.threshold = kMuchLower * page.threshold;
    bool any = false;
    looked_at = sift(list, page, away_m, 2 * hold_s,
                     [&](const Entry&, const Source&, const SievePart&) { any = true; });
    if (!any) return looked_at;
  }
  list.give_m = give_m(kGiveOfDistance, kLeastGive_m);
  if (2 * step_m_ / scale >= list.give_m) list.give_m = 0;
  list.threshold = kLower * page.threshold;
  return looked_at +
         sift(list, page, away_m, hold_s,
              [&](const Entry& entry, const Source& stored, const SievePart& part) {
                list.entries.push_back(entry);
                list.shapes.push_back({stored.position_m, stored.normal, stored.mirror, part});
              });
}

}  // namespace clamor
