// page_shortlists.h: per page, the sources that can reach the threshold while the listener is near.
//
// One keyframe later the listener has moved by 3 cm, and nearly the same sources of a page could
// reach the threshold. So what culling (source_page.h) leaves is kept with upper bounds that hold
// in a ball ahead of the listener, whose radius is a twentieth of the distance to the page (more
// for short lists: ListReach). A keyframe tests only those, 16 at a time: the upper bound, the
// loudness of the signal's bands at the moment that is heard, what is known of the occlusion
// (occlusion_upper_bounds.h), and at last the upper bound at this very place (shortlist_kernel.h).
// A list is made for a share of the lowest recent threshold, and anew outside its ball, after its
// time, below its threshold, or far above it (kMaxListExcess).
//
// Most of the cost is waiting for memory, so what is read for every source lies apart from what is
// read for few.
//
// Threads: the sampler's alone.   Memory: 84 bytes per source in a list.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <span>
#include <utility>
#include <vector>

#include "common/flat_hash_map.h"
#include "common/vec.h"
#include "formats/bake_file/instance.h"
#include "formats/bake_file/source_octree.h"
#include "runtime/occlusion/occlusion_upper_bounds.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/signal_maps.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/propagation/source_page.h"
#include "runtime/propagation/tolerances.h"
#include "runtime/query/node_bounds.h"
#include "runtime/query/shortlist_kernel.h"
#include "runtime/query/source_pool.h"
#include "runtime/query/validity_region.h"
#include "runtime/query/work_budget.h"
#include "runtime/realtime/prefetch.h"

namespace clamor {

// The lowest threshold of late. Thresholds rise and fall with syllables: caches that are made at a
// high one would all be made anew at the next low one. A single fall, as where a door opens, is
// forgotten after a while.
class ThresholdHistory {
 public:
  void add(double threshold, std::uint32_t keyframe) {
    lowest_ = 0;
    share_ = 1;
    if (!(threshold > 0)) return;
    if (keyframe % query::kThresholdMemory_keyframes == 0)
      before_ = std::exchange(current_, threshold);
    current_ = std::min(current_, threshold);
    lowest_ = std::min(before_, current_);
    share_ = std::max(lowest_ / threshold, query::kMinRecentThreshold);
  }
  double lowest() const { return lowest_; }
  // Returns lowest() as a share of the last threshold, at least a third.
  double share() const { return share_; }

 private:
  double lowest_ = 0, share_ = 1;
  double before_ = std::numeric_limits<double>::infinity();  // of some keyframes
  double current_ = before_;                                 // of those after them
};

// A page of sources, and the query that its list is made for, in the space of its tree.
struct ShortlistPage {
  const SourcePage& sources;
  const NodeSummary& bounds;
  ValidityRegion query;
  const Placement* placement = nullptr;  // of the instance; null: the level itself
  const SignalMaps& maps;
  std::uint32_t map = SignalMaps::kNone;
  double error_m = 0;  // rounding of the sources' positions
};

class PageShortlists {
 public:
  // `weights` are those of max_over_instances(); both must outlive the lists.
  PageShortlists(const RadiationModel& radiation, const SignalWeights& weights);

  // A new keyframe. Until `until_s` no signal is louder than `max_share` of its maximum.
  void begin(const QueryKeyframe& keyframe, double max_share, double until_s);
  // The threshold of this keyframe, in the level.
  void add_threshold(double threshold) { thresholds_.add(threshold, keyframes_); }
  double lowest_threshold() const { return thresholds_.lowest(); }

  // The list of the page whose first source has this number, empty at first. Its index holds until
  // generation() changes.
  std::uint32_t list_of(std::uint64_t first);
  std::uint32_t generation() const { return generation_; }

  bool holds(std::uint32_t list, const ValidityRegion& query) const {
    const List& one = lists_[list];
    return one.region.contains(query) &&
           (one.count == 0 ||
            thresholds_.share() * query.threshold <= query::kMaxListExcess * one.region.threshold);
  }
  // Makes a list anew. Returns the number of sources that were tested.
  std::size_t renew(std::uint32_t list, const ShortlistPage& page);
  const ValidityRegion& region(std::uint32_t list) const { return lists_[list].region; }
  bool is_empty(std::uint32_t list) const { return lists_[list].count == 0; }
  // Marks a list as used and charges its test. Returns the number of its sources.
  std::size_t use(std::uint32_t list);
  void prefetch(std::uint32_t list) const { prefetch_to_read(&lists_[list], sizeof(List)); }

  // The cost of making and testing lists since the last call (work_budget.h).
  std::uint64_t take_work() { return std::exchange(work_, 0); }

  // A list to test, for a listener and a threshold in the space of its tree.
  struct Test {
    std::uint32_t list = 0;
    Vec3 place{};
    double threshold = 0, error_m = 0;
  };
  // A source whose priority can reach the threshold now, by what is known of its occlusion.
  struct Passed {
    std::size_t test = 0;   // index of the test
    std::size_t index = 0;  // in its page
    std::uint32_t signal = 0;
    double upper_bound = 0;  // of its priority at any time
    float boost = 0;         // late boost at full strength, less 1
  };
  // Calls found(Passed), by test and then by index.
  template <class Found>
  void test(std::span<const Test> tests, const Found& found) {
    find_audible_entries(tests);
    bound_at_place(tests);
    std::size_t l = 0;
    for (std::uint32_t t = 0; t < tests.size(); ++t) {
      const List& list = lists_[tests[t].list];
      const auto threshold = static_cast<float>(tests[t].threshold * (1 - query::kThresholdSlack));
      for (; l < scratch_.ends[t]; ++l) {
        const float bound = scratch_.upper_bounds[l] * scratch_.audible.share[l];
        if (bound < threshold) continue;
        const std::uint32_t entry = scratch_.audible.entry[l];
        const ShortlistBlock& block = list.blocks[entry / kCullBlock];
        const std::uint32_t index = block.source[entry % kCullBlock];
        if (bound * scratch_.occlusion[t].upper_bound(index, scratch_.audible.known[l]) < threshold)
          continue;
        found(Passed{t, index, block.signal[entry % kCullBlock],
                     static_cast<double>(scratch_.upper_bounds[l]), scratch_.here[l].boost});
      }
    }
  }

 private:
  struct List {
    explicit List(std::pmr::memory_resource* memory) : blocks(memory), bounds(memory) {}

    std::uint64_t first = 0;
    ValidityRegion region;
    std::uint32_t used = 0, count = 0;
    std::pmr::vector<ShortlistBlock> blocks;
    std::pmr::vector<SourceBound> bounds;  // of each source, from the centre of the region
  };
  // Memory of test(): per test, and per source that passed the test of loudness.
  struct Scratch {
    std::vector<OcclusionUpperBounds::Window> occlusion;
    std::vector<std::size_t> ends;  // of the test's audible entries
    AudibleEntries audible;
    std::vector<SourceBound> here;  // from the listener; padded by one vector
    std::vector<float> upper_bounds;
  };

  void drop_lists(bool all);
  ValidityRegion region_for(const List& list, const ShortlistPage& page) const;
  void add(List& list, const ShortlistPage& page, std::size_t index, float upper_bound);
  void find_audible_entries(std::span<const Test> tests);
  void bound_at_place(std::span<const Test> tests);

  const RadiationModel& radiation_;
  const SignalWeights& weights_;
  // One pool for all lists, so that they share few memory pages.
  std::pmr::unsynchronized_pool_resource memory_{std::pmr::pool_options{0, 1 << 16}};
  std::vector<List> lists_;
  FlatHashMap<std::uint32_t> list_of_;  // 1 + list, by the number of its first source
  LoudnessTable loudness_;
  float max_delay_s_ = 0;  // of any source in a list
  CulledPage culled_;
  Scratch scratch_;
  QueryKeyframe keyframe_;
  double max_share_ = 1, quiet_until_s_ = 0;  // how loud signals are, and until when
  ThresholdHistory thresholds_;
  std::uint32_t generation_ = 0, keyframes_ = 0;
  std::uint64_t work_ = 0;
};

}  // namespace clamor
