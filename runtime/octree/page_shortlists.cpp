#include "runtime/octree/page_shortlists.h"

#include <algorithm>

namespace clamor {

namespace {

// How far lists hold, and how much lower than they must they reach; by what they had before.
struct Reach {
  double of_distance, least_m, lower;
};
constexpr Reach kReach{1.0 / 30, 0.1, 0.8}, kReachOfFew{1.0 / 12, 0.25, 0.65},
    kReachOfNone{1.0 / 8, 0.4, 0.5};
constexpr double kAhead = 0.85;  // of how far they hold, their middles are
constexpr std::uint32_t kFew = kSieveBlock / 2;
constexpr double kHold_s = 0.6;                         // and up to twice as long
constexpr double kRises = 1.01, kLeastLower = 1.0 / 3;  // of thresholds, per keyframe
constexpr float kUsualGive_s = 0.003f;
constexpr std::uint32_t kTurns = 16;
// Lists that were not used for so long are dropped, now and then.
constexpr std::uint32_t kForget_keyframes = 256;

}  // namespace

void PageShortlists::begin(const Vec3& place, double time_s, double loudest, double until_s) {
  const bool back = time_s < time_s_;  // lists hold until later than now, but not from now on
  time_s_ = time_s;
  loudest_ = loudest;
  until_s_ = until_s;
  step_m_ = place - place_;
  place_ = place;
  ++keyframe_;
  if (back || keyframe_ % kForget_keyframes == 0) {
    std::erase_if(lists_, [&](const List& list) {
      return back || keyframe_ - list.used > kForget_keyframes;
    });
    rehash(kFirstSlots);
    ++numbering_;
  }
  seen_.clear();
  for (const LoudnessTrack& track : ceilings_.tracks) seen_.push_back(track.seen_at(time_s));
  shares_.tabulate(seen_, longest_s_, kUsualGive_s);
}

// Thresholds go up and down with syllables, and lists made at a high one would all be made anew at
// the next low one.
void PageShortlists::expect(double threshold) {
  lowest_ = std::min(lowest_ > 0 ? kRises * lowest_ : threshold, threshold);
  lower_ = threshold > 0 ? std::max(lowest_ / threshold, kLeastLower) : 1;
}

void PageShortlists::prefetch(std::size_t list) const {
  const List& one = lists_[list];
  for (std::size_t b = 0; b < std::min<std::size_t>(one.blocks.size(), 3); ++b)
    for (std::size_t line = 0; line < sizeof(ShortlistBlock); line += 64)
      __builtin_prefetch(reinterpret_cast<const char*>(&one.blocks[b]) + line);
}

void PageShortlists::loud_entries(std::size_t list, const Vec3& place, double threshold,
                                  std::vector<LoudEntry>& entries) const {
  static const SharesNow kAllLoud;
  constexpr HiddenNumbers::Near kNothingHidden;
  const List& from = lists_[list];
  const auto least = static_cast<float>(threshold * (1 - 1e-6));
  const std::size_t before = entries.size();
  entries.resize(before + kSieveBlock * from.blocks.size());
  entries.resize(before + loud_now(from.blocks, Vec3f(place - from.place), least,
                                   from.give_s <= kUsualGive_s ? shares_ : kAllLoud,
                                   hidden_ != nullptr ? hidden_->near(from.first) : kNothingHidden,
                                   entries.data() + before));
}

void PageShortlists::rehash(std::size_t size) {
  while (size < 4 * lists_.size()) size *= 2;
  slots_.assign(size, 0);
  for (std::size_t l = 0; l < lists_.size(); ++l) {
    std::size_t at = scattered(lists_[l].first);
    while (slots_[at & (size - 1)] != 0) ++at;
    slots_[at & (size - 1)] = static_cast<std::uint32_t>(l + 1);
  }
}

// Who walks on reaches the middle of the ball that a list holds for, and only then its far side.
Vec3 PageShortlists::ahead_of(const MetPage& page, double give_m) const {
  const double step_m = length(step_m_);
  if (!(step_m > 0)) return page.place;
  Vec3 ahead = step_m_ / step_m;
  if (page.placement != nullptr) ahead = glm::transpose(page.placement->rotation) * ahead;
  return page.place + kAhead * give_m * ahead;
}

// Those of a page that `list` must have from now on, as it says where it holds and above what.
template <class Kept>
std::size_t PageShortlists::sift(List& list, const MetPage& page, double away_m, double hold_s,
                                 const Kept& kept) {
  const double scale = page.placement != nullptr ? page.placement->scale : 1;
  list.place = ahead_of(page, list.give_m);
  list.until_s = seen_.empty() ? until_s_ : std::min(until_s_, time_s_ + hold_s);
  list.give_s =
      static_cast<float>((list.give_m * scale + 1e-3) / field_.speed_of_sound_mps() + 1e-6);
  list.count = 0;
  list.blocks.clear();
  const SieveGive give{list.give_m, std::max(away_m, 1 / scale)};
  const auto least = static_cast<float>(list.threshold * (1 - 1e-6));
  return page.sources.pass(
      list.place, list.threshold / loudest_,
      [&](std::size_t index, double most, const SievePart& part) {
        std::uint32_t emitter = part.emitter;
        float leaves_s = part.delay_s;
        if (page.placement != nullptr) {
          emitter += page.placement->emitters;
          if (emitter >= field_.emitter_count()) return;  // of a forged file
          leaves_s = page.placement->delayed_s(leaves_s);
        }
        const double way_m = scale * length(list.place - part.position_m);
        const auto delay_s = static_cast<float>(field_.leaves_s(emitter, leaves_s) +
                                                way_m / field_.speed_of_sound_mps());
        const std::uint32_t signal = page.maps.signal(page.map, field_.signal(part.emitter));
        const auto ceiling = static_cast<float>(most);
        if (seen_.empty() ||
            ceiling * seen_[signal].most_share(delay_s, list.give_s, list.until_s - time_s_) >=
                least)
          kept(index, ceiling, delay_s, signal, part);
      },
      give);
}

// One who walks faster than lists hold has no use for their give. A list that was short most likely
// stays so: then it may hold for longer, and is passed as quickly.
std::size_t PageShortlists::fill(List& list, const MetPage& page) {
  const Vec3 low(page.bounds.low_m), high(page.bounds.high_m);
  const double away_m = length(glm::max(glm::max(low - page.place, page.place - high), Vec3(0)));
  const double scale = page.placement != nullptr ? page.placement->scale : 1;
  const bool is_new = list.give_m < 0;
  const Reach& reach = is_new || list.count > kFew ? kReach
                       : list.count > 0            ? kReachOfFew
                                                   : kReachOfNone;
  list.give_m =
      std::min(std::max(reach.of_distance * away_m, reach.least_m / scale), kMostGive_m / scale);
  list.threshold = reach.lower * lower_ * page.threshold;
  if (2 * length(step_m_) / scale >= list.give_m) {
    list.give_m = 0;
    list.threshold = kReach.lower * page.threshold;
  }
  // Not all at once.
  turn_ = (turn_ + 1) % kTurns;
  const double hold_s = kHold_s * (1 + static_cast<double>(turn_) / kTurns);
  const std::size_t looked_at = sift(list, page, away_m, hold_s,
                                     [&](std::size_t index, float ceiling, float delay_s,
                                         std::uint32_t signal, const SievePart& part) {
                                       page.sources.prefetch(index);
                                       longest_s_ = std::max(longest_s_, delay_s);
                                       const std::size_t at = list.count++ % kSieveBlock;
                                       if (at == 0) list.blocks.emplace_back().ceiling.fill(-1);
                                       ShortlistBlock& block = list.blocks.back();
                                       block.ceiling[at] = ceiling;
                                       block.delay_s[at] = delay_s;
                                       block.signal[at] = signal;
                                       block.index[at] = static_cast<std::uint32_t>(index);
                                       block.radius2_m2[at] = part.radius2_m2;
                                       block.diffuse[at] = part.diffuse;
                                       block.lobe[at] = part.lobe;
                                       block.fall[at] = part.fall;
                                       block.over_cos_i[at] = part.over_cos_i;
                                       block.boost[at] = field_.late_boost().at(part.delay_s);
                                     });
  for (std::size_t e = 0; e < list.count; ++e) {
    ShortlistBlock& block = list.blocks[e / kSieveBlock];
    const std::size_t at = e % kSieveBlock;
    const Source& stored = page.sources[block.index[at]];
    const Vec3f position_m(Vec3(stored.position_m) - list.place);
    for (int axis = 0; axis < 3; ++axis) {
      const auto row = static_cast<std::size_t>(axis);
      block.position_m[row][at] = position_m[axis];
      block.normal[row][at] = stored.normal[axis];
      block.mirror[row][at] = stored.mirror[axis];
    }
  }
  return looked_at;
}

}  // namespace clamor
