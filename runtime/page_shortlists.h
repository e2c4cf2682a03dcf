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

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/vec.h"
#include "formats/instance.h"
#include "formats/source_octree.h"
#include "runtime/hidden_numbers.h"
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

class PageShortlists {
 public:
  // `ceilings` as OctreePool's; both must outlive the lists.
  PageShortlists(const SourceField& field, const SignalWeights& ceilings)
      : field_(field), ceilings_(ceilings) {}

  // The listener's place in the level, and the time, for what follows.
  void begin(const Vec3& place, double time_s);
  // Leaves these out; null: none.
  void leave_out(const HiddenNumbers* hidden) { hidden_ = hidden; }

  // Calls found(index, signal, ceiling), ascending, for each source of a page whose priority may be
  // the threshold or more; the ceiling is of its priority at any time. Gives how many were looked
  // at one by one.
  template <class Found>
  std::size_t pass(const MetPage& page, const Found& found) {
    List& list = lists_[page.first];
    std::size_t looked_at = list.entries.size();
    if (!holds(list, page)) looked_at += fill(list, page);
    list.used = keyframe_;
    const auto least = static_cast<float>(page.threshold * (1 - 1e-6));
    std::uint64_t word = ~std::uint64_t{0}, left_out = 0;
    for (const Entry& entry : list.entries) {
      if (entry.ceiling < least) continue;
      if (hidden_ != nullptr) {
        const std::uint64_t number = page.first + entry.index;
        if (number / 64 != word) left_out = hidden_->left_out(word = number / 64);
        if ((left_out >> (number % 64) & 1) != 0) continue;
      }
      if (!seen_.empty() &&
          entry.ceiling * seen_[entry.signal].share(entry.delay_s, list.give_s) < least)
        continue;
      found(entry.index, entry.signal, static_cast<double>(entry.ceiling));
    }
    return looked_at;
  }

 private:
  struct Entry {
    float ceiling = 0;
    float delay_s = 0;  // to where the listener was
    std::uint32_t signal = 0, index = 0;
  };
  struct List {
    Vec3 place{};
    double give_m = -1;  // how far from there it holds
    double threshold = 0;
    float give_s = 0;
    std::uint32_t used = 0;
    std::vector<Entry> entries;
  };

  bool holds(const List& list, const MetPage& page) const {
    const Vec3 moved_m = page.place - list.place;
    return dot(moved_m, moved_m) <= list.give_m * list.give_m && list.give_m >= 0 &&
           page.threshold >= list.threshold && page.threshold <= kTooLong * list.threshold;
  }
  std::size_t fill(List& list, const MetPage& page);

  // A list reaches lower than it must, so that it holds for a while; and is cut short where it
  // reaches far too low.
  static constexpr double kLower = 0.8, kTooLong = 3;

  const SourceField& field_;
  const SignalWeights& ceilings_;
  const HiddenNumbers* hidden_ = nullptr;
  std::unordered_map<std::uint64_t, List> lists_;
  std::vector<LoudnessTrack::Seen> seen_;  // per signal; empty: nothing changes
  Vec3 place_{};
  double step_m_ = 0;  // from keyframe to keyframe
  std::uint32_t keyframe_ = 0;
};

}  // namespace clamor
