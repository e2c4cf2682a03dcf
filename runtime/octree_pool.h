// octree_pool.h: the sources of a heap-ordered octree (source_octree.h) whose pages may be missing.
//
// A look-up walks down from the top and leaves out a node where
//
//   highest key x most that a power of 1 can weigh / (distance to its bounds)^2 < threshold,
//
// or where its emission cone points away: nothing in it or below can reach the threshold. Of a page
// that is missing its parent's page knows the bound, and so it is asked for in that order.
//
// A copy of a tree (instance.h) is walked in the tree's own space: the place is moved instead of
// the sources, and the threshold divided by the copy's gain. Only what is found is put where the
// level has it.
//
// Signals that are over, or have not begun, raise no bound: only what they play, smoothed, within
// the longest way to the listener counts.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "formats/bake_file.h"
#include "formats/octree_page.h"
#include "runtime/page_loader.h"
#include "runtime/source_pool.h"

namespace clamor {

// Weights that no copy's sources exceed, whatever signals it plays instead: of the ceilings.
SignalWeights highest_over_copies(const SignalWeights& weights,
                                  std::span<const std::vector<std::uint32_t>> signal_maps);

// Pages as a loader wants them, from a file. Everything must outlive what comes out.
PageLoader::Fetch pages_of(const BakeFile& file, const SourceField& field,
                           const SignalWeights& ceilings);

class OctreePool final : public SourcePool {
 public:
  // `trees` and `signal_maps` as in BakeFile; the last tree is the level's. `ceilings` are those of
  // highest_over_copies(). All must outlive the pool. Fetches the first pages with sources of each
  // tree, for good.
  OctreePool(const SourceField& field, const SignalWeights& ceilings,
             std::span<const PageEntry> trees,
             std::span<const std::vector<std::uint32_t>> signal_maps, PageLoader& loader);

  bool refresh() override { return loader_.begin_sample(); }
  // Bounds nodes by the loudest that any signal was while what is heard now was under way.
  void begin(const Vec3& place, double time_s) override;
  bool look(const Vec3& place, double threshold, std::size_t most,
            std::vector<FoundSource>& found) override;
  double highest(const Vec3& place) override;
  double unseen_key(const FoundSource& found, double tau) override;
  void ask(const Vec3& soon, double tau) override;
  bool missed() const override { return !missed_.empty(); }
  bool complete() override;
  std::uint64_t size() const override { return trees_.empty() ? 0 : trees_.back().sources_below; }

  std::uint64_t nodes_visited() const { return visited_; }  // by all looks so far

 private:
  static constexpr std::uint32_t kNoMap = 0xffffffff;

  // Where sources are found: the level's octree, or a copy of one.
  struct Copy {
    const PageEntry* tree = nullptr;  // whose cube the octants divide
    Placement placement;
    Vec3 place{};                // of the listener, in the tree's space
    double to_threshold = 1;     // there, of a threshold here
    std::uint32_t map = kNoMap;  // into maps_
    bool moved = false;          // not simply the level
  };

  // A node to visit. Where the representative of its copy is in it or below, that has `lead_key`.
  struct Step {
    const PageEntry* entry = nullptr;
    std::uint32_t copy = 0;
    std::uint64_t first = 0;  // number of its first source
    double lead_key = 0;
  };

  void load_first_pages(const PageEntry& top);
  // Most that a priority in the node or below it can be, in the space of its tree.
  double bound(const PageEntry& entry, const Vec3& place, double highest_key) const;
  // Calls visit(step, page, urgency) for all nodes that matter, with what page_of(entry) gives,
  // until it returns false; goes no further below a page that is null.
  template <class PageOf, class Visit>
  bool walk(const Vec3& place, double threshold, const PageOf& page_of, const Visit& visit);
  void add_steps(const Step& from, const ResidentPage& page, double threshold);
  void add_copies(const Step& from, const ResidentPage& page, double threshold);
  void add_source(const Step& step, const ResidentPage& page, std::size_t index, bool leads,
                  std::vector<FoundSource>& found);
  std::uint32_t composed(std::uint32_t outer, std::uint32_t inner);
  std::uint32_t signal_of(const Source& source, const Copy& copy) const;

  const SourceField& field_;
  const std::span<const PageEntry> trees_;
  const std::span<const std::vector<std::uint32_t>> signal_maps_;
  const SignalWeights& ceilings_;
  std::vector<Bands> audible_;  // what ceilings come to now
  double most_per_power_;
  PageLoader& loader_;

  // Of the last look.
  std::deque<Copy> copies_;
  std::deque<Source> placed_;
  std::vector<WantedPage> missed_;
  bool all_here_ = true;
  Vec3 place_{};

  std::vector<Step> steps_;
  std::deque<std::vector<std::uint32_t>> maps_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> known_maps_;
  std::uint32_t last_outer_ = kNoMap, last_inner_ = kNoMap, last_map_ = kNoMap;
  bool asked_ = false;
  std::uint64_t visited_ = 0;
};

}  // namespace clamor
