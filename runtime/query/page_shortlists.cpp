#include "runtime/query/page_shortlists.h"

#include <algorithm>
#include <utility>

namespace clamor {

namespace {

// How far lists hold, and how much lower than they must they reach; by what they had before.
struct Reach {
  double of_distance, least_m, lower;
};
constexpr Reach kReach{1.0 / 20, 0.15, 0.9}, kReachOfFew{1.0 / 12, 0.25, 0.75},
    kReachOfNone{1.0 / 8, 0.4, 0.6};
constexpr double kAhead = 0.85;     // of how far they hold, their middles are;
constexpr double kAside = 1.05;     // or as far as what they are asked for allows, with some room
constexpr double kRounds_m = 2e-6;  // a shape's way, single precision, of lists that hold for 8 m
constexpr std::uint32_t kFew = kCullBlock / 2;
constexpr double kQuiet = 0.5;   // all signals, if none is louder soon than that share of its most
constexpr double kHold_s = 0.4;  // and up to twice as long
constexpr double kLeastLower = 1.0 / 3;          // threshold of late, of that of now
constexpr std::uint32_t kOfLate_keyframes = 32;  // and up to twice as many
constexpr float kUsualGive_s = 0.009f;
constexpr std::uint32_t kTurns = 16;
// Lists that were not used for so long are dropped, now and then.
constexpr std::uint32_t kForget_keyframes = 256;
constexpr std::size_t kBlocksAhead = 3;  // of each list

}  // namespace

void PageShortlists::begin(const Vec3& place, double time_s, double ahead_s, double loudest,
                           double until_s) {
  const bool back = time_s < time_s_;  // lists hold until later than now, but not from now on
  time_s_ = time_s;
  loudest_ = loudest;
  until_s_ = until_s;
  step_m_ = place - place_;
  place_ = place;
  ++keyframe_;
  if (back || keyframe_ % kForget_keyframes == 0) {
    const auto dropped = std::erase_if(lists_, [&](const List& list) {
      return back || keyframe_ - list.used > kForget_keyframes;
    });
    if (dropped > 0) {
      rehash(kFirstSlots);
      ++numbering_;
    }
  }
  shares_.tabulate(weights_.tracks, time_s, ahead_s, longest_s_, kUsualGive_s);
  if (widest_s_ > kUsualGive_s)
    wide_shares_.tabulate(weights_.tracks, time_s, ahead_s, longest_s_, widest_s_);
}

// Thresholds go up and down with syllables, and lists made at a high one would all be made anew at
// the next low one. A fall of once, as where a door opens, is forgotten after a while.
void PageShortlists::expect(double threshold) {
  lowest_ = 0;
  lower_ = 1;
  if (!(threshold > 0)) return;
  if (keyframe_ % kOfLate_keyframes == 0)
    lowest_before_ = std::exchange(lowest_of_these_, threshold);
  lowest_of_these_ = std::min(lowest_of_these_, threshold);
  lowest_ = std::min(lowest_before_, lowest_of_these_);
  lower_ = std::max(lowest_ / threshold, kLeastLower);
}

// From memory, what lists have.
void PageShortlists::fetch(std::span<const Asked> asked) {
  near_.clear();
  for (const Asked& one : asked) {
    const List& list = lists_[one.list];
    prefetch_to_read(list.blocks.data(),
                     std::min(list.blocks.size(), kBlocksAhead) * sizeof(ShortlistBlock));
    near_.push_back(hidden_ != nullptr ? hidden_->window(list.first, turns_ahead_)
                                       : OcclusionUpperBounds::Window());
    near_.back().prefetch();
  }
}

const LoudnessTable& PageShortlists::shares_for(float give_s) const {
  static const LoudnessTable kAll;
  if (shares_.hold_for(give_s)) return shares_;
  return wide_shares_.hold_for(give_s) ? wide_shares_ : kAll;
}

void PageShortlists::find_loud(std::span<const Asked> asked) {
  std::size_t blocks = 0;
  for (const Asked& one : asked) blocks += lists_[one.list].blocks.size();
  loud_.make_room(kCullBlock * blocks);
  loud_count_ = 0;
  ends_.clear();
  for (std::size_t a = 0; a < asked.size(); ++a) {
    const List& list = lists_[asked[a].list];
    const std::size_t before = loud_count_;
    loud_count_ += find_audible(list.blocks, static_cast<float>(asked[a].threshold * (1 - 1e-6)),
                                shares_for(list.give_s), near_[a], loud_.from(before));
    for (std::size_t l = before; l < loud_count_; ++l)
      __builtin_prefetch(&list.shape_of(loud_.entry[l]));
    ends_.push_back(loud_count_);
  }
}

void PageShortlists::ask_for_ceilings(std::span<const Asked> asked) {
  if (here_.size() < loud_count_) {
    here_.resize(loud_count_);
    ceilings_.resize(loud_count_);
  }
  std::size_t l = 0;
  double off_m = 0;
  for (std::size_t a = 0; a < asked.size(); ++a) {
    off_m = std::max(off_m, asked[a].off_m);
    const List& list = lists_[asked[a].list];
    const Vec3f moved_m(asked[a].place - list.sifted.place);
    for (; l < ends_[a]; ++l) {
      here_[l] = list.shape_of(loud_.entry[l]);
      here_[l].position_m -= moved_m;
    }
  }
  upper_bounds_at(std::span(here_).first(loud_count_), static_cast<float>(off_m + kRounds_m),
                  ceilings_.data());
}

void PageShortlists::rehash(std::size_t size) {
  while (size < 4 * lists_.size()) size *= 2;
  slots_.assign(size, 0);
  for (std::size_t l = 0; l < lists_.size(); ++l) {
    std::size_t at = fibonacci_hash(lists_[l].first);
    while (slots_[at & (size - 1)] != 0) ++at;
    slots_[at & (size - 1)] = static_cast<std::uint32_t>(l + 1);
  }
}

// Who walks on reaches the middle of the ball that a list holds for, and only then its far side.
Vec3 PageShortlists::ahead_of(const MetPage& page, double give_m) const {
  const double step_m = length(step_m_);
  if (!(step_m > 0)) return page.scope.place;
  Vec3 ahead = step_m_ / step_m;
  if (page.placement != nullptr) ahead = glm::transpose(page.placement->rotation) * ahead;
  const double away_m = std::min(kAhead * give_m, give_m - kAside * page.scope.give_m);
  return page.scope.place + std::max(away_m, 0.0) * ahead;
}

// Those of a page that `list` must have from now on, as it says where it holds and above what.
template <class Found>
std::size_t PageShortlists::sift(List& list, const MetPage& page, double away_m,
                                 const Found& found) {
  const double scale = page.placement != nullptr ? page.placement->scale : 1;
  list.sifted.place = ahead_of(page, list.sifted.give_m);
  const bool all_quiet = loudest_ < kQuiet;  // then few are found, but not for long
  list.sifted.until_s = all_quiet ? until_s_ : std::numeric_limits<double>::infinity();
  list.give_s =
      static_cast<float>((list.sifted.give_m * scale + 1e-3) / field_.speed_of_sound_mps() + 1e-6);
  widest_s_ = std::max(widest_s_, list.give_s);
  list.shapes.clear();
  list.kept.clear();
  const CullMargin give{list.sifted.give_m + page.off_m, std::max(away_m, 1 / scale)};
  return page.sources.pass(
      list.sifted.place, list.sifted.threshold / (all_quiet ? loudest_ : 1),
      [&](std::size_t index, double most, const CullRecord& part) {
        std::uint32_t emitter = part.emitter;
        float emission_time_s = part.delay_s;
        if (page.placement != nullptr) {
          emitter += page.placement->emitters;
          if (emitter >= field_.emitter_count()) return;  // of a forged file
          emission_time_s = page.placement->delayed_s(emission_time_s);
        }
        const double way_m = scale * length(list.sifted.place - part.position_m);
        const auto delay_s = static_cast<float>(field_.emission_time_s(emitter, emission_time_s) +
                                                way_m / field_.speed_of_sound_mps());
        const std::uint32_t signal = page.maps.signal(page.map, field_.signal(part.emitter));
        found(index, static_cast<float>(most), delay_s, signal, part);
      },
      give);
}

// One who walks faster than lists hold has no use for more give than is asked for. A list that was
// short most likely stays so: then it may hold for longer, and is passed as quickly.
std::size_t PageShortlists::fill(List& list, const MetPage& page) {
  const Vec3 low(page.bounds.low_m), high(page.bounds.high_m);
  const Vec3& place = page.scope.place;
  const double away_m = length(glm::max(glm::max(low - place, place - high), Vec3(0)));
  const double scale = page.placement != nullptr ? page.placement->scale : 1;
  const bool is_new = list.sifted.give_m < 0;
  const Reach& reach = is_new || list.count > kFew ? kReach
                       : list.count > 0            ? kReachOfFew
                                                   : kReachOfNone;
  list.sifted.give_m =
      std::min(std::max(reach.of_distance * away_m, reach.least_m / scale), kMostGive_m / scale);
  list.sifted.threshold = reach.lower * lower_ * page.scope.threshold;
  if (2 * length(step_m_) / scale >= list.sifted.give_m) {
    list.sifted.give_m = kAside * page.scope.give_m;
    list.sifted.threshold = kReach.lower * page.scope.threshold;
  }
  const auto keep = [&](std::size_t index, float ceiling, float delay_s, std::uint32_t signal,
                        const CullRecord& part) {
    page.sources.prefetch(index);
    longest_s_ = std::max(longest_s_, delay_s);
    list.kept.push_back(
        {ceiling, delay_s, signal, ShortlistBlock::packed(index, list.kept.size()), part.mix});
    SourceShape& shape = list.shapes.emplace_back();
    shape.radius2_m2 = part.radius2_m2;
    shape.diffuse = part.diffuse;
    shape.lobe = part.lobe;
    shape.fall = part.fall;
    shape.bounce = part.bounce;
    shape.slope = part.slope;
    shape.boost = field_.late_boost().at(part.delay_s);
  };
  const std::size_t looked_at = sift(list, page, away_m, keep);
  for (std::size_t k = 0; k < list.kept.size(); ++k) {
    const Source& stored = page.sources[list.kept[k].source & ShortlistBlock::kIndex];
    SourceShape& shape = list.shapes[k];
    shape.position_m = Vec3f(Vec3(stored.position_m) - list.sifted.place);
    shape.normal = stored.normal;
    shape.mirror = stored.mirror;
  }
  return looked_at;
}

// Of those that are kept, the ones that are loud enough from now on, for a while.
void PageShortlists::take_loud(List& list) {
  list.until_s = std::numeric_limits<double>::infinity();
  if (!weights_.steady()) {  // not all at once
    turn_ = (turn_ + 1) % kTurns;
    list.until_s = time_s_ + kHold_s * (1 + static_cast<double>(turn_) / kTurns);
  }
  list.until_s = std::min(list.until_s, list.sifted.until_s);
  list.count = 0;
  list.blocks.clear();
  const auto least = static_cast<float>(list.sifted.threshold * (1 - 1e-6));
  for (const Kept& kept : list.kept) {
    if (!weights_.steady()) {
      const float share = weights_.tracks[kept.signal].max_share(
          kept.mix, time_s_, kept.delay_s, list.give_s, list.until_s - time_s_);
      if (kept.ceiling * share < least) continue;
    }
    const std::size_t at = list.count++ % kCullBlock;
    if (at == 0) list.blocks.emplace_back().ceiling.fill(-1);
    ShortlistBlock& block = list.blocks.back();
    block.ceiling[at] = kept.ceiling;
    block.delay_s[at] = kept.delay_s;
    block.signal[at] = kept.signal;
    block.source[at] = kept.source;
    block.mix[at] = kept.mix;
  }
}

}  // namespace clamor
