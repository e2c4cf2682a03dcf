#include "runtime/page_shortlists.h"

#include <algorithm>

namespace clamor {

namespace {

constexpr double kGiveOfDistance = 1.0 / 30, kLeastGive_m = 0.1;
// Lists that were not used for so long are dropped, now and then.
constexpr std::uint32_t kForget_keyframes = 256;

}  // namespace

void PageShortlists::begin(const Vec3& place, double time_s) {
  step_m_ = length(place - place_);
  place_ = place;
  if (++keyframe_ % kForget_keyframes == 0)
    std::erase_if(lists_, [this](const auto& list) {
      return keyframe_ - list.second.used > kForget_keyframes;
    });
  seen_.clear();
  for (const LoudnessTrack& track : ceilings_.tracks) seen_.push_back(track.seen_at(time_s));
}

// One who walks faster than lists hold has no use for their give.
std::size_t PageShortlists::fill(List& list, const MetPage& page) {
  const Vec3 low(page.bounds.low_m), high(page.bounds.high_m);
  const double away_m = length(glm::max(glm::max(low - page.place, page.place - high), Vec3(0)));
  const Vec3 listener =
      page.placement != nullptr ? page.placement->outside(page.place) : page.place;
  const double scale = page.placement != nullptr ? page.placement->scale : 1;
  const double give_m = std::max(kGiveOfDistance * away_m, kLeastGive_m / scale);
  list.place = page.place;
  list.give_m = 2 * step_m_ / scale < give_m ? give_m : 0;
  list.threshold = kLower * page.threshold;
  list.give_s =
      static_cast<float>((list.give_m * scale + 1e-3) / field_.speed_of_sound_mps() + 1e-6);
  list.entries.clear();
  const SieveGive give{list.give_m, std::max(away_m, 1 / scale)};
  return page.sources.pass(
      page.place, list.threshold,
      [&](std::size_t index, double ceiling) {
        const Source& stored = page.sources[index];
        Entry entry{static_cast<float>(ceiling), 0, 0, static_cast<std::uint32_t>(index)};
        if (page.placement == nullptr) {
          entry.delay_s = static_cast<float>(field_.delay_s(stored, listener));
        } else {
          const Source placed = page.placement->place(stored);
          if (placed.emitter >= field_.emitter_count()) return;  // of a forged file
          entry.delay_s = static_cast<float>(field_.delay_s(placed, listener));
        }
        entry.signal = page.maps.signal(page.map, field_.signal(stored));
        list.entries.push_back(entry);
      },
      give);
}

}  // namespace clamor
