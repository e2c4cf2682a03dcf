// probe_pool.h: the reflections of moving sources, as copies of the trees of the probes round them.
//
// First reflections are each source's own (first_reflections.h), and so are its images in mirrors.
// For all later ones, each moving source is heard through up to eight probes (probe_neighbours.h)
// and their zones, and each of these copies holds the secondary sources of a tree, moved to the
// source's place (probe_sources.h), with its signal, gain and directivity. They are ranked together
// with all other sources. Of a level with 500 probes and 1000 moving sources these are ten million,
// of which a query looks at few: a tree is traversed once per query for all its copies, with the
// highest factor of any of them, and a source that is found meets those copies that hold it.
//
// Copies must not choose alike, or a crowd near one probe would be heard from one wall. As in
// instance.h, each copy has one representative, drawn with a probability in proportion to its
// power, whose permanent number is v P_i / P, with v the copy's own number and P the power of the
// tree; every other source has P_i / P + (1 - P_i / P) u. Each number is uniform by itself, keys of
// other sources only fall, and a crowd far away is sampled by its representatives, which are
// independent.
//
// Where many sources share a tree, that is not enough: of 150 sources with two voices each, those
// reflections that are near the listener would still be chosen by all or by none. A copy that is
// one of a crowd therefore holds only one in 2^n of the tree's sources, each with 2^n times its
// power; which ones, hashes of the copy's and the source's numbers decide (crowd_level() and
// Tree::order). The powers of all copies of a crowd become much alike by that, too.
//
// Threads: the sampler's alone.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/occlusion/occlusion_upper_bounds.h"
#include "runtime/probes/first_reflections.h"
#include "runtime/probes/probe_neighbours.h"
#include "runtime/probes/probe_sources.h"
#include "runtime/query/node_bounds.h"
#include "runtime/query/page_requests.h"
#include "runtime/query/source_pool.h"
#include "runtime/query/work_budget.h"
#include "runtime/sampling/moving_source_list.h"
#include "runtime/streaming/page_loader.h"

namespace clamor {

// Numbers of the sources of probes, for occlusion: above those of the level, below those of moving
// sources.
inline constexpr std::uint64_t kFirstProbeSource = std::uint64_t{1} << 62;
// First reflections have numbers from here on.
inline constexpr std::uint64_t kFirstTracedReflection =
    kFirstProbeSource + (std::uint64_t{1} << 61);

class ProbePool {
 public:
  // All arguments must outlive the pool. `loader` reads pages of probes (probe_page_fetch()).
  // `with_images`: mirrors make image sources, of which only a sampler that tests their occlusion
  // knows where they are heard.
  ProbePool(const StoredProbes& probes, const ProbeBounds& bounds,
            const OcclusionGeometry& surfaces, FirstReflectionTracer tracer,
            const SignalWeights& weights, MovingSourceList& moving, PageLoader& loader,
            bool with_images);

  // As in SourcePool.
  void charge(WorkBudget* budget) { budget_ = budget; }
  bool refresh();
  void set_occlusion_bounds(const OcclusionUpperBounds* bounds) { occlusion_ = bounds; }
  void set_late_boost(float strength);
  // The shares of the power that pass each set of portals and each portal, 0 to 1; those beyond
  // the end of a list are open.
  void set_portals(std::vector<float> openness_by_set, std::vector<float> openness) {
    openness_by_set_ = std::move(openness_by_set);
    openness_ = std::move(openness);
  }
  void begin(const Listener& listener, double time_s);
  bool find_above(const Vec3& place, double threshold, std::size_t max_count,
                  std::vector<FoundSource>& found);
  double upper_bound(const Vec3& place);
  double missing_key(const FoundSource& found) const;
  void request_pages(double threshold);
  bool lacks_pages() const { return requests_.any_missing(); }
  bool complete() { return requests_.wait(); }
  // Moving sources of the last keyframe that have no reflections because they see no probe.
  std::size_t unseen_sources() const { return neighbours_.unseen(); }

 private:
  // A moving source heard through a tree.
  struct Copy {
    std::uint32_t tree = 0, slot = 0;
    float factor = 0;                  // of upper bounds, now
    float loudness = 0;                // of the signal at any time, with the weight
    float weight = 0;                  // of the tree
    float u = 1;                       // v
    std::uint32_t level = 0;           // it holds one in 2^level sources
    std::uint32_t hash = 0;            // decides which: those whose first `level` bits agree
    std::uint32_t representative = 0;  // index in the top page
    double draw = 0;                   // decides the representative, in [0, 1)

    float scale() const { return static_cast<float>(std::uint32_t{1} << level); }  // of powers
  };
  // Copies of a tree that have one level.
  struct Crowd {
    std::uint32_t level = 0, first_copy = 0, copy_count = 0;  // in copies_, by hash
    float factor = 0;                                         // the highest
  };
  struct Tree {
    const PageEntry* entry = nullptr;                // of the top
    std::optional<Vec3> probe_m;                     // none: the late reflections of a zone
    std::uint64_t first_source = 0;                  // its number
    double power = 0;                                // of the tree
    std::uint32_t first_copy = 0, copy_count = 0;    // in copies_
    std::uint32_t first_crowd = 0, crowd_count = 0;  // in crowds_
    float factor = 0;                                // the highest of a copy
    double loudness = 0;                             // of all copies
    double missing_key = 0;                          // of the last query
    const ResidentPage* top = nullptr;               // the page; null: it is missing
    // The page's sources divide the tree's power among them; these are the ends of their shares, in
    // the order of their hashes.
    std::vector<std::uint32_t> order;
    std::vector<double> share_ends;
  };
  // A moving source of the keyframe.
  struct Radiator : MovingRadiator {
    Bands power{};          // factor of each band
    float factor = 0;       // of upper bounds, now: that of the loudest band
    Bands band_shares{};    // that of each band, over it
    float at_any_time = 1;  // the factor at any time, over that now
  };
  // A source of a copy, and what missing_key() needs to know of the stored one.
  struct Placed {
    Source source;
    std::uint32_t tree = 0;
    double stored_power = 0, share = 0;
    bool is_representative = false;
  };
  // The image of a moving source in a mirror.
  struct Image {
    std::uint32_t slot = 0, mirror = 0;  // and the mirror's number
    MirrorPlane plane;
    double upper_bound = 0;
    bool is_placed = false;  // `source` and what follows are known
    Source source;
    Vec3f velocity_mps{};
    std::uint64_t cell = 0;
  };
  struct Waiting {
    const PageEntry* entry = nullptr;
    std::uint64_t first = 0;  // number of its first source
  };

  void add_copies(std::size_t slot, double time_s);
  Radiator radiator_of(std::size_t slot, double now_s) const;
  void add_copy(std::size_t slot, std::uint32_t tree, float weight);
  void thin_crowds();
  void sort_copies();
  void read_top(Tree& tree, const Vec3& place);
  void draw_representatives(const Tree& tree);
  void spend(std::uint64_t units) {
    if (budget_ != nullptr) budget_->spend(units);
  }
  bool is_exhausted() const { return budget_ != nullptr && budget_->is_exhausted(); }
  double bound(const Tree& tree, const PageEntry& entry, const Vec3& place) const;
  bool find_in_tree(Tree& tree, const Vec3& place, double threshold, std::size_t max_count,
                    std::vector<FoundSource>& found);
  void find_in_page(const Tree& tree, const ResidentPage& page, std::uint64_t first,
                    const Vec3& place, double threshold, std::vector<FoundSource>& found);
  void find_first_reflections(const Vec3& place, double threshold, std::size_t max_count,
                              std::vector<FoundSource>& found);
  bool has_left(const Source& source, std::size_t slot) const;
  // The share that a source has in the power of a copy.
  static double share_of(const Tree& tree, const Copy& copy, const Source& stored) {
    return std::min(1.0, static_cast<double>(copy.scale()) * sum_of(stored.power) / tree.power);
  }
  void list_images();
  void find_images(double threshold, std::vector<FoundSource>& found);
  void place(Image& image);
  void find_representatives(const Tree& tree, const Vec3& place, double threshold,
                            std::vector<FoundSource>& found);
  std::span<const Copy> copies_of(const Tree& tree) const {
    return std::span(copies_).subspan(tree.first_copy, tree.copy_count);
  }
  std::span<const Copy> holders(const Crowd& crowd, std::uint32_t hash) const;
  void add(const Tree& tree, const Copy& copy, const Source& stored, std::uint64_t number,
           bool is_representative, float boost, double bound, std::vector<FoundSource>& found);
  Placed& next_placed();
  FoundSource& append(Placed& placed, std::size_t slot, float weight, std::uint64_t number,
                      std::vector<FoundSource>& found);

  const ProbeBounds& bounds_;
  const SignalWeights& weights_;
  MovingSourceList& moving_;
  PageLoader& loader_;
  const OcclusionUpperBounds* occlusion_ = nullptr;
  SignalWeights unit_weights_;  // of node_bounds_
  NodeBounds node_bounds_;
  ProbeNeighbours neighbours_;
  FirstReflections first_reflections_;
  PageRequests requests_;
  std::vector<std::uint32_t> zone_trees_;  // by place: index into trees_
  std::vector<Tree> trees_;                // of the places, then of the zones
  std::vector<std::uint32_t> active_;      // trees with copies
  std::vector<Copy> copies_;
  std::vector<Crowd> crowds_;
  std::vector<Radiator> radiators_;  // by slot
  std::deque<Placed> placed_;        // the first placed_count_ are in use
  std::size_t placed_count_ = 0;
  std::vector<Waiting> waiting_;
  CulledPage culled_;
  std::vector<FirstReflections::Found> reaching_;
  std::vector<Image> images_;  // of the keyframe
  double longest_s_ = 0;       // that sound is under way
  double time_s_ = 0;          // of the keyframe,
  Vec3 place_m_{};             // and its listener's place
  float boost_strength_ = 1;
  std::vector<float> openness_by_set_, openness_;  // of portals
  WorkBudget* budget_ = nullptr;
};

}  // namespace clamor
