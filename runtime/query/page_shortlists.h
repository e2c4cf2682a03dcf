// page_shortlists.h: which sources of each page may matter, for as long as the listener is near.
//
// A keyframe later the listener is 3 cm further on, and nearly the same sources of a page could
// reach the threshold: so what the sieve (source_culler.h) lets through is kept, with ceilings that
// hold for a ball round where the listener was, a twentieth of the distance to the page wide, or
// more if the list is short. Of these a list takes the ones that will be loud enough within half a
// second or so, and a keyframe looks at those: the ceiling, how loud its bands are at the moment
// that is heard, whether the source is known to be hidden (occlusion_upper_bounds.h), the ceiling
// at this very place (shortlist_kernel.h). What is left is found as the sieve itself would have
// found it, and a few more. When that time is over, a list takes anew of what was kept; when the
// listener leaves the ball, or the threshold falls below the list's, the sieve is asked again.
// Lists reach as low as thresholds fell of late: these go up and down with syllables, and else all
// lists would be made anew at once.
//
// What that costs: tests/benchmarks/occlusion_benchmark.cpp. All of it is waiting for memory, so
// what is asked of every source lies apart from what is asked of few.
//
// Threads: the sampler's alone.   Memory: 104 bytes per source that is kept.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <span>
#include <utility>
#include <vector>

#include "common/fibonacci_hash.h"
#include "common/vec.h"
#include "formats/bake_file/instance.h"
#include "formats/bake_file/source_octree.h"
#include "runtime/occlusion/occlusion_upper_bounds.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/signal_maps.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/query/culled_node_cache.h"
#include "runtime/query/shortlist_kernel.h"
#include "runtime/query/source_page.h"
#include "runtime/query/work_budget.h"
#include "runtime/realtime/prefetch.h"

namespace clamor {

// Where, until when and above which threshold something holds, or is to hold.
struct Scope {
  Vec3 place{};
  double give_m = -1;  // how far from there; below 0: nowhere
  double threshold = 0, until_s = 0;

  // In all of another.
  bool holds(const Scope& other) const {
    const Vec3 way_m = other.place - place;
    const double left_m = give_m - other.give_m;
    return left_m >= 0 && dot(way_m, way_m) <= left_m * left_m && other.threshold >= threshold &&
           other.until_s <= until_s;
  }
};

// A page as it is met on a walk, and what is asked of its list, in its tree's space.
struct MetPage {
  const SourcePage& sources;
  const NodeSummary& bounds;
  std::uint64_t first = 0;  // number of its first source: no other page's
  Scope scope;
  const Placement* placement = nullptr;  // of the tree's copy; null: the level itself
  const SignalMaps& maps;
  std::uint32_t map = SignalMaps::kNone;
  double off_m = 0;  // how far off its sources may be heard: the level rounds where they are
};

class PageShortlists {
 public:
  // No list holds farther than that.
  static constexpr double kMostGive_m = 8;

  // `ceilings` as OctreePool's; both must outlive the lists.
  PageShortlists(const RadiationModel& field, const SignalWeights& ceilings)
      : field_(field), weights_(ceilings), slots_(kFirstSlots) {}

  // The listener's place in the level, and the time, for what follows, and for how long it may be
  // asked to hold.
  // `loudest`: until then no signal is louder than that share of the most that it ever is.
  void begin(const Vec3& place, double time_s, double ahead_s, double loudest, double until_s);
  // What follows is asked with thresholds about that high, seen from the level.
  void expect(double threshold);
  double lowest_of_late() const { return lowest_; }
  // Leaves these out; null: none. Not those either that will be in turn in `ahead` keyframes.
  void set_occlusion_bounds(const OcclusionUpperBounds* hidden, std::uint32_t ahead) {
    hidden_ = hidden;
    turns_ahead_ = ahead;
  }

  // Which list is a page's, made anew if it does not hold; and where the page is quiet, if it is.
  // Adds to `looked_at` how many sources that took.
  std::size_t list_of(const MetPage& page, ValidityRegion& quiet, std::uint64_t& looked_at) {
    List& list = found_or_made(page.first);
    looked_at += renew(list, page);
    list.used = keyframe_;
    quiet = held(list);
    if (list.count > 0) quiet.give_m = -1;
    looked_at += list.count;
    work_ += list.count;
    return static_cast<std::size_t>(&list - lists_.data());
  }
  // The same in two steps, for who asks again and again: which list is that of the page whose first
  // source has this number, as long as numbering() stays what it is; and whether it holds here.
  std::size_t number_of(std::uint64_t first) {
    List& list = found_or_made(first);
    list.used = keyframe_;
    return static_cast<std::size_t>(&list - lists_.data());
  }
  std::uint32_t numbering() const { return numbering_; }
  // Returns the cost of making and passing lists since the last call (work_budget.h).
  std::uint64_t take_work() { return std::exchange(work_, 0); }
  bool holds(std::size_t list, const Scope& scope) const { return holds(lists_[list], scope); }
  void renew(std::size_t list, const MetPage& page, std::uint64_t& looked_at) {
    looked_at += renew(lists_[list], page);
  }
  // Where, when and above which threshold it does.
  ValidityRegion held(std::size_t list) const { return held(lists_[list]); }
  void use(std::size_t list, std::uint64_t& looked_at) {
    lists_[list].used = keyframe_;
    looked_at += lists_[list].count;
    work_ += lists_[list].count;
  }
  bool is_empty(std::size_t list) const { return lists_[list].count == 0; }
  // Fetches what holds() and renew() will want, and, a little later, what it keeps.
  void prefetch(std::size_t list) const { prefetch_to_read(&lists_[list], sizeof(List)); }
  void prefetch_kept(std::size_t list) const {
    const List& one = lists_[list];
    prefetch_to_read(one.kept.data(), one.kept.size() * sizeof(Kept));
    __builtin_prefetch(one.blocks.data());
  }
  // A list, the listener's place in its tree's space, and the threshold there; `off_m` as
  // MetPage's, and as far round that place.
  struct Asked {
    std::size_t list = 0;
    Vec3 place{};
    double threshold = 0, off_m = 0;
  };
  // A source whose priority may be the threshold or more from now on, as long as begin() said, by
  // what is known of what stands in the way.
  struct Passed {
    std::size_t asked = 0;  // which
    std::size_t index = 0;  // in its page
    std::uint32_t signal = 0;
    double ceiling = 0;          // of its priority at any time,
    float share = 1, known = 1;  // of that now; and of that, what is known to be heard
    float boost = 0;
  };
  // Calls found(Passed), ascending.
  template <class Found>
  void pass(std::span<const Asked> asked, const Found& found) {
    fetch(asked);
    find_loud(asked);
    ask_for_ceilings(asked);
    std::size_t l = 0;
    for (std::uint32_t a = 0; a < asked.size(); ++a) {
      const List& list = lists_[asked[a].list];
      const auto least = static_cast<float>(asked[a].threshold * (1 - 1e-6));
      for (; l < ends_[a]; ++l) {
        const float ceiling = ceilings_[l], share = loud_.share[l], known = loud_.known[l];
        if (ceiling * share < least) continue;
        const ShortlistBlock& block = list.blocks[loud_.entry[l] / kCullBlock];
        const std::size_t at = loud_.entry[l] % kCullBlock;
        const std::uint32_t index = block.source[at] & ShortlistBlock::kIndex;
        if (ceiling * share * near_[a].upper_bound(index, known) < least) continue;
        found(Passed{a, index, block.signal[at], static_cast<double>(ceiling), share, known,
                     here_[l].boost});
      }
    }
  }

 private:
  // Of a source that may reach the threshold if its signal is as loud as it ever is.
  struct Kept {
    float ceiling = 0, delay_s = 0;
    std::uint32_t signal = 0, source = 0;
    BandMix mix;
  };
  struct List {
    explicit List(std::pmr::memory_resource* memory)
        : blocks(memory), kept(memory), shapes(memory) {}

    std::uint64_t first = 0;
    Scope sifted;        // where what is kept has all that matters,
    double until_s = 0;  // and until when the blocks do
    float give_s = 0;
    std::uint32_t used = 0;
    std::uint32_t count = 0;                  // in the blocks
    std::pmr::vector<ShortlistBlock> blocks;  // of those that may be loud enough until `until_s`
    std::pmr::vector<Kept> kept;
    std::pmr::vector<SourceShape> shapes;  // of each that is kept

    const SourceShape& shape_of(std::size_t entry) const {
      const ShortlistBlock& block = blocks[entry / kCullBlock];
      return shapes[block.source[entry % kCullBlock] >> ShortlistBlock::kIndexBits];
    }
  };

  List& found_or_made(std::uint64_t first) {
    if (2 * (lists_.size() + 1) > slots_.size()) rehash(2 * slots_.size());
    for (std::size_t at = fibonacci_hash(first);; ++at) {
      std::uint32_t& slot = slots_[at & (slots_.size() - 1)];
      if (slot == 0) {
        lists_.emplace_back(&memory_).first = first;
        slot = static_cast<std::uint32_t>(lists_.size());
      }
      if (List& list = lists_[slot - 1]; list.first == first) return list;
    }
  }
  void rehash(std::size_t size);
  bool is_sifted(const List& list, const Scope& scope) const {
    return list.sifted.holds(scope) &&
           (list.count == 0 || lower_ * scope.threshold <= kTooLong * list.sifted.threshold);
  }
  static ValidityRegion held(const List& list) {
    return {list.sifted.place, list.sifted.give_m, list.sifted.threshold, list.until_s};
  }
  bool holds(const List& list, const Scope& scope) const {
    return scope.until_s <= list.until_s && is_sifted(list, scope);
  }
  // How many sources that took.
  std::size_t renew(List& list, const MetPage& page) {
    std::size_t looked_at = 0;
    if (!is_sifted(list, page.scope)) {
      looked_at = fill(list, page);
      work_ += WorkBudget::kCulledSource * looked_at;
    } else if (page.scope.until_s <= list.until_s) {
      return 0;
    }
    take_loud(list);
    work_ += WorkBudget::kKeptSource * list.kept.size();
    return looked_at;
  }
  void take_loud(List& list);
  const LoudnessTable& shares_for(float give_s) const;
  void fetch(std::span<const Asked> asked);
  void find_loud(std::span<const Asked> asked);
  void ask_for_ceilings(std::span<const Asked> asked);
  std::size_t fill(List& list, const MetPage& page);
  Vec3 ahead_of(const MetPage& page, double give_m) const;
  template <class Found>
  std::size_t sift(List& list, const MetPage& page, double away_m, const Found& found);

  // A list reaches lower than it must, so that it holds for a while; and is cut short where it
  // reaches far too low.
  static constexpr std::size_t kFirstSlots = 1 << 10;
  static constexpr double kTooLong = 3;

  const RadiationModel& field_;
  const SignalWeights& weights_;
  const OcclusionUpperBounds* hidden_ = nullptr;
  std::uint32_t turns_ahead_ = 0;
  // Of lists, together, so that they share the translations of few addresses.
  std::pmr::unsynchronized_pool_resource memory_{std::pmr::pool_options{0, 1 << 16}};
  std::vector<List> lists_;
  std::vector<std::uint32_t> slots_;    // 1 + which list, open addressing, a power of two; 0: free
  LoudnessTable shares_, wide_shares_;  // of signals whose delays are off by little, and by more
  float longest_s_ = 0, widest_s_ = 0;  // of any list: delay, and by how much that is off
  // Of pass(): of each list,
  std::vector<OcclusionUpperBounds::Window> near_;
  std::vector<std::size_t> ends_;  // where its loud entries end,
  AudibleEntries loud_;            // these, the first so many,
  std::size_t loud_count_ = 0;
  std::vector<SourceShape> here_;  // as each is seen from the listener
  std::vector<float> ceilings_;
  Vec3 place_{};
  Vec3 step_m_{};                  // from keyframe to keyframe
  double lowest_ = 0, lower_ = 1;  // threshold of late, and as a share of that of now
  double lowest_before_ = std::numeric_limits<double>::infinity();  // of some keyframes,
  double lowest_of_these_ = lowest_before_;                         // and of those after them
  double time_s_ = 0, loudest_ = 1, until_s_ = 0;
  std::uint32_t turn_ = 0, numbering_ = 0;
  std::uint32_t keyframe_ = 0;
  std::uint64_t work_ = 0;
};

}  // namespace clamor
