// page_shortlists.h: which sources of each page may matter, for as long as the listener is near.
//
// A keyframe later the listener is 3 cm further on, and nearly the same sources of a page could
// reach the threshold: so what the sieve (source_sieve.h) lets through is kept, with ceilings that
// hold for a ball round where the listener was, a thirtieth of the distance to the page wide. Then
// a keyframe looks at short lists: the ceiling, whether the source is known to be hidden
// (hidden_numbers.h), and how loud its signal is at the moment that is heard. What is left is found
// as the sieve itself would have found it, and a few more. When the listener leaves the ball, or
// the threshold falls below the list's, the sieve makes the list anew.
//
// Of a million sources, with envelopes, that is a third of what asking all sieves costs
// (tests/benchmarks/sight_benchmark.cpp).
//
// Threads: the sampler's alone.   Memory: 16 bytes per source in a list.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "common/vec.h"
#include "formats/instance.h"
#include "formats/source_octree.h"
#include "runtime/hidden_numbers.h"
#include "runtime/quiet_nodes.h"
#include "runtime/signal_maps.h"
#include "runtime/signal_weights.h"
#include "runtime/source_field.h"
#include "runtime/source_page.h"

namespace clamor {

// A page as it is met on a walk, with the listener's place and a threshold in its tree's space.
struct MetPage {
  const SourcePage& sources;
  const NodeSummary& bounds;
  std::uint64_t first = 0;  // number of its first source: no other page's
  Vec3 place{};
  double threshold = 0;
  const Placement* placement = nullptr;  // of the tree's copy; null: the level itself
  const SignalMaps& maps;
  std::uint32_t map = SignalMaps::kNone;
};

// A source as its ceiling depends on where one is.
struct SourceShape {
  Vec3f position_m{}, normal{}, mirror{};
  SievePart part;

  // Of the priority at any time, here and nowhere else (source_sieve.h).
  float ceiling(const Vec3& place) const {
    constexpr float kRounds = 4e-6f, kSlack = 1.0005f;
    const Vec3f way_m(place - Vec3(position_m));
    const float r2 = glm::dot(way_m, way_m);
    const float near2 = std::max(r2 * (1 - kRounds), part.radius2_m2);
    if (r2 < 1e-8f) return kSlack * (part.diffuse + part.lobe) / near2;
    const float over_r = 1 / std::sqrt(r2);
    const bool all_round = part.over_cos_i < 0;
    const float cos_o = all_round ? 1 : std::min(glm::dot(way_m, normal) * over_r + kRounds, 1.0f);
    if (cos_o <= 0) return 0;
    const float cos_a = std::min(glm::dot(way_m, mirror) * over_r + kRounds, 1.0f);
    const float tilt = std::min(cos_o * std::abs(part.over_cos_i), 1.0f);
    return kSlack * (part.diffuse * cos_o + part.lobe * tilt * decay(part.fall * (1 - cos_a))) /
           near2;
  }

 private:
  // exp(-t) for t >= 0, within 1e-4; never below 2^-100.
  static float decay(float t) {
    const float y = std::min(t * 1.44269504f, 100.0f);
    const auto whole = static_cast<std::int32_t>(y + 0.5f);
    const float z = static_cast<float>(whole) - y;
    const float part =
        1 + z * (0.69314718f + z * (0.24022651f + z * (0.05550411f + z * 0.00961813f)));
    return part * std::bit_cast<float>((127 - whole) << 23);
  }
};

class PageShortlists {
 public:
  // No list holds farther than that.
  static constexpr double kMostGive_m = 8;

  // `ceilings` as OctreePool's; both must outlive the lists.
  PageShortlists(const SourceField& field, const SignalWeights& ceilings)
      : field_(field), ceilings_(ceilings), slots_(kFirstSlots) {}

  // The listener's place in the level, and the time, for what follows.
  // `loudest`: until then no signal is louder than that share of the most that it ever is.
  void begin(const Vec3& place, double time_s, double loudest, double until_s);
  // Leaves these out; null: none.
  void leave_out(const HiddenNumbers* hidden) { hidden_ = hidden; }

  // Which list is a page's, made anew if it does not hold here and now; and where the page is
  // quiet, if it is. Adds to `looked_at` how many sources that took.
  std::size_t list_of(const MetPage& page, Quiet& quiet, std::uint64_t& looked_at) {
    List& list = found_or_made(page.first);
    if (!holds(list, page)) looked_at += fill(list, page);
    list.used = keyframe_;
    quiet = {list.place, list.entries.empty() ? list.give_m : -1, list.threshold, list.until_s};
    looked_at += list.entries.size();
    return static_cast<std::size_t>(&list - lists_.data());
  }
  bool is_empty(std::size_t list) const { return lists_[list].entries.empty(); }
  // Fetches what pass() will want, a little later.
  void prefetch(std::size_t list) const {
    const List& one = lists_[list];
    for (std::size_t at = 0; at < std::min<std::size_t>(one.entries.size(), 24); at += 3)
      __builtin_prefetch(&one.entries[at]);
    for (std::size_t at = 0; at < std::min<std::size_t>(one.shapes.size(), 8); ++at)
      __builtin_prefetch(&one.shapes[at]);
    if (hidden_ != nullptr) {
      const HiddenNumbers::Row& row = hidden_->row_of(one.first);
      for (std::uint64_t ahead = 0; ahead < 512; ahead += 128) row.prefetch(one.first + ahead);
    }
  }

  // Calls found(index, signal, ceiling, boost), ascending, for each source of a page whose priority
  // may be the threshold or more; the ceiling is of its priority at any time.
  template <class Found>
  void pass(std::size_t of, const Vec3& place, double threshold, std::uint64_t first,
            const Found& found) const {
    const List& list = lists_[of];
    const auto least = static_cast<float>(threshold * (1 - 1e-6));
    const HiddenNumbers::Row* row = nullptr;
    std::uint64_t row_of = 0;
    for (std::size_t e = 0; e < list.entries.size(); ++e) {
      const Entry& entry = list.entries[e];
      if (entry.ceiling < least) continue;
      float share = seen_.empty() ? 1 : seen_[entry.signal].share(entry.delay_s, list.give_s);
      if (entry.ceiling * share < least) continue;
      if (hidden_ != nullptr) {
        const std::uint64_t number = first + entry.index;
        if (row == nullptr || number / HiddenNumbers::kRow != row_of) {
          row_of = number / HiddenNumbers::kRow;
          row = &hidden_->row_of(number);
        }
        share *= hidden_->most(*row, number);
        if (entry.ceiling * share < least) continue;
      }
      const float ceiling = list.shapes[e].ceiling(place);
      if (ceiling * share < least) continue;
      found(entry.index, entry.signal, static_cast<double>(ceiling), entry.boost);
    }
  }

 private:
  struct Entry {
    float ceiling = 0;
    float delay_s = 0;  // to where the listener was
    std::uint32_t signal = 0, index = 0;
    float boost = 0;  // at full strength, less 1
  };
  struct List {
    std::uint64_t first = 0;
    Vec3 place{};
    double give_m = -1;  // how far from there it holds
    double threshold = 0, until_s = 0;
    float give_s = 0;
    std::uint32_t used = 0;
    std::vector<Entry> entries;
    std::vector<SourceShape> shapes;  // of the entries
  };

  static std::size_t hash_of(std::uint64_t first) {
    first *= 0x9e3779b97f4a7c15u;
    return static_cast<std::size_t>(first ^ (first >> 32));
  }
  List& found_or_made(std::uint64_t first) {
    if (2 * (lists_.size() + 1) > slots_.size()) rehash(2 * slots_.size());
    for (std::size_t at = hash_of(first);; ++at) {
      std::uint32_t& slot = slots_[at & (slots_.size() - 1)];
      if (slot == 0) {
        lists_.emplace_back().first = first;
        slot = static_cast<std::uint32_t>(lists_.size());
      }
      if (List& list = lists_[slot - 1]; list.first == first) return list;
    }
  }
  void rehash(std::size_t size);
  bool holds(const List& list, const MetPage& page) const {
    const Vec3 moved_m = page.place - list.place;
    return dot(moved_m, moved_m) <= list.give_m * list.give_m && list.give_m >= 0 &&
           page.threshold >= list.threshold && time_s_ <= list.until_s &&
           (list.entries.empty() || page.threshold <= kTooLong * list.threshold);
  }
  std::size_t fill(List& list, const MetPage& page);
  template <class Kept>
  std::size_t sift(List& list, const MetPage& page, double away_m, double hold_s, const Kept& kept);

  // A list reaches lower than it must, so that it holds for a while; and is cut short where it
  // reaches far too low.
  static constexpr std::size_t kFirstSlots = 1 << 10;
  static constexpr double kLower = 0.8, kMuchLower = 0.5, kTooLong = 3;

  const SourceField& field_;
  const SignalWeights& ceilings_;
  const HiddenNumbers* hidden_ = nullptr;
  std::vector<List> lists_;
  std::vector<std::uint32_t> slots_;  // 1 + which list, open addressing, a power of two; 0: free
  std::vector<LoudnessTrack::Seen> seen_;  // per signal; empty: nothing changes
  Vec3 place_{};
  double step_m_ = 0;  // from keyframe to keyframe
  double time_s_ = 0, loudest_ = 1, until_s_ = 0;
  std::uint32_t turn_ = 0;
  std::uint32_t keyframe_ = 0;
};

}  // namespace clamor
