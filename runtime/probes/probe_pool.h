// probe_pool.h: the reflections of moving sources.
//
// First reflections are each source's own (first_reflections.h), and so are its images in mirrors
// (image_pool.h). All later ones are copies of the trees of the probes round it (probe_copies.h),
// ranked together with all other sources. A level with 500 probes and 1000 moving sources has ten
// million of them, of which a query tests few: a tree is traversed once per query for all its
// copies, with the highest factor of any of them, and a source that is found is then tested for
// each copy that holds it.
//
// Threads: the sampler's alone.
#pragma once

#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/probes/first_reflections.h"
#include "runtime/probes/image_pool.h"
#include "runtime/probes/probe_copies.h"
#include "runtime/probes/probe_neighbours.h"
#include "runtime/probes/probe_sources.h"
#include "runtime/query/octree_traversal.h"
#include "runtime/query/page_requests.h"
#include "runtime/query/source_pool.h"
#include "runtime/sampling/moving_source_list.h"
#include "runtime/streaming/page_loader.h"

namespace clamor {

class ProbePool final : public SourcePool {
 public:
  // All arguments must outlive the pool. `loader` reads pages of probes (probe_page_fetch()).
  // `with_images`: mirrors make image sources, of which only a sampler that tests their occlusion
  // knows where they are heard.
  ProbePool(const StoredProbes& probes, const ProbeBounds& bounds,
            const OcclusionGeometry& surfaces, FirstReflectionTracer tracer,
            const SignalWeights& weights, MovingSourceList& moving, PageLoader& loader,
            bool with_images);

  bool refresh() override;
  // Begins a keyframe after the moving sources have.
  void begin(const QueryKeyframe& keyframe) override;
  bool find_above(double threshold, std::size_t max_count,
                  std::vector<FoundSource>& found) override;
  double upper_bound() override;
  double missing_key(const FoundSource& found, double threshold) override;
  void request_pages(double threshold) override { requests_.send(threshold); }
  bool lacks_pages() const override { return requests_.any_missing(); }
  bool complete() override { return requests_.wait(); }
  // Copies of probes count as many: only whether there are fewer sources than voices matters.
  std::uint64_t size() const override { return std::uint64_t{1} << 32; }

  // The shares of the power that pass each set of portals and each portal, 0 to 1; those beyond
  // the end of a list are open.
  void set_portals(std::vector<float> openness_by_set, std::vector<float> openness) {
    openness_by_set_ = std::move(openness_by_set);
    openness_ = std::move(openness);
  }
  // The images in mirrors, a pool of its own that begins a keyframe after this one.
  MirrorImages& images() { return images_; }
  // Moving sources of the last keyframe that have no reflections because they see no probe.
  std::size_t unseen_sources() const { return neighbours_.unseen(); }

 private:
  using Tree = ProbeCopies::Tree;
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
  // A secondary source, stored in a tree.
  struct Stored {
    const Source& source;
    std::uint64_t number = 0;
    bool is_representative = false;  // of the copy
  };

  void add_source(std::size_t slot);
  Radiator radiator_of(std::size_t slot) const;
  bool find_in_tree(Tree& tree, double threshold, std::size_t max_count,
                    std::vector<FoundSource>& found);
  void find_in_page(const Tree& tree, const ResidentPage& page, std::uint64_t first,
                    double threshold, std::vector<FoundSource>& found);
  void find_representatives(const Tree& tree, double threshold, std::vector<FoundSource>& found);
  void find_first_reflections(double threshold, std::size_t max_count,
                              std::vector<FoundSource>& found);
  BoostedBound boosted(const Source& stored, std::uint64_t number, double upper_bound) const;
  bool has_left(const Source& source, std::size_t slot) const;
  void add(const ProbeCopy& copy, const Stored& stored, const BandMix& mix,
           const BoostedBound& bound, double threshold, std::vector<FoundSource>& found);
  Placed& next_placed();
  FoundSource& append(Placed& placed, std::size_t slot, float weight, std::uint64_t number,
                      std::vector<FoundSource>& found);

  const ProbeBounds& bounds_;
  const SignalWeights& weights_;
  MovingSourceList& moving_;
  PageLoader& loader_;
  SignalWeights unit_weights_;  // of context_
  QueryContext context_;
  OctreeTraversal traversal_;
  ProbeNeighbours neighbours_;
  FirstReflections first_reflections_;
  MirrorImages images_;
  PageRequests requests_;
  ProbeCopies copies_;
  std::vector<Radiator> radiators_;  // by slot
  std::deque<Placed> placed_;        // the first placed_count_ are in use
  std::size_t placed_count_ = 0;
  CulledPage culled_;
  std::vector<FirstReflections::Found> reaching_;
  double longest_s_ = 0;                           // that sound is under way
  std::vector<float> openness_by_set_, openness_;  // of portals
};

}  // namespace clamor
