// octree_pool.h: the sources of a heap-ordered octree (source_octree.h) whose pages may be missing.
//
// A query finds the sources whose priority can reach a threshold at a place:
//
//   octree_traversal.h    walks down to the nodes that can hold one, or, in most keyframes,
//   node_front.h          has kept these nodes since a traversal for all places near by;
//   page_shortlists.h     has kept the sources of each node's page that can reach it near by;
//   shortlist_kernel.h    tests these, 16 at a time, for this moment and this very place.
//
// Sources of pages in memory are culled by upper bounds alone, so within its budget a query finds
// what testing all sources would find. Each cached result knows the region of place,
// threshold and time that it holds in (validity_region.h).
//
// The bound of a page that is missing is known from its parent's page, so missing pages are
// requested in the order of their bounds (page_requests.h).
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/page_links.h"
#include "runtime/query/node_front.h"
#include "runtime/query/octree_traversal.h"
#include "runtime/query/page_requests.h"
#include "runtime/query/page_shortlists.h"
#include "runtime/query/source_pool.h"
#include "runtime/streaming/page_loader.h"

namespace clamor {

// Reads pages from a file for a loader. Everything must outlive what comes out.
PageLoader::Fetch page_fetch(const BakeFile& file, const RadiationModel& radiation,
                             const SignalWeights& weights);

class OctreePool final : public SourcePool {
 public:
  // `trees` and `signal_maps` as in BakeFile; the last tree is the level's. `weights` are those of
  // max_over_instances(). All must outlive the pool. Reads the first pages with sources of each
  // tree, which stay in memory.
  OctreePool(const RadiationModel& radiation, const SignalWeights& weights,
             std::span<const PageEntry> trees,
             std::span<const std::vector<std::uint32_t>> signal_maps, PageLoader& loader);

  bool refresh() override;
  void begin(const QueryKeyframe& keyframe) override;
  bool find_above(double threshold, std::size_t max_count,
                  std::vector<FoundSource>& found) override;
  double upper_bound() override;
  double missing_key(const FoundSource& found, double threshold) override;
  void request_pages(double threshold) override;
  bool lacks_pages() const override { return requests_.any_missing(); }
  bool complete() override { return requests_.wait(); }
  std::uint64_t size() const override {
    return context_.trees.empty() ? 0 : context_.trees.back().sources_below;
  }

  // Totals of all queries so far: nodes that were traversed or whose shortlist was made, nodes that
  // fronts were made of, sources that were tested with their own bound or in a shortlist, and
  // instances whose representative stood for them.
  std::uint64_t nodes_visited() const { return totals_.visited; }
  std::uint64_t front_nodes() const { return totals_.front_nodes; }
  std::uint64_t sources_tested() const { return totals_.tested; }
  std::uint64_t representatives_found() const { return totals_.representatives; }

 private:
  using Frame = OctreeTraversal::Frame;
  static constexpr std::uint32_t kNoFrame = 0xffffffff;  // of a representative

  struct Totals {
    std::uint64_t visited = 0, front_nodes = 0, tested = 0, representatives = 0;
  };
  // A page whose shortlist is about to be tested.
  struct Pending {
    OctreeTraversal::Node node;
    const Source* sources = nullptr;
    std::uint32_t list = 0;
    double threshold = 0;      // in its tree
    bool skips_first = false;  // which is the representative, and was found already
  };
  // The calls of a keyframe, in this order; find_above() may be repeated.
  enum class Stage : std::uint8_t { kIdle, kRefreshed, kBegun, kQueried };

  void load_first_pages(const PageEntry& top);
  void update_representatives();

  bool find_by_traversal(std::size_t max_count, std::vector<FoundSource>& found);
  void visit_page(const OctreeTraversal::Node& node, const ResidentPage& page,
                  std::vector<FoundSource>& found);
  bool find_in_front(std::size_t max_count, std::vector<FoundSource>& found);
  NodeFront::Result test_front_node(const NodeFront::Node& node);
  void prefetch(const NodeFront::Node& node) const;
  void add_pending(const Pending& page, std::vector<FoundSource>& found);
  void test_pending(std::vector<FoundSource>& found);
  void add_source(const OctreeTraversal::Node& node, const Source& stored, std::size_t index,
                  const PageShortlists::Passed& passed, double threshold, double key,
                  std::vector<FoundSource>& found);
  void add_distant(const OctreeTraversal::DistantInstance& distant,
                   std::vector<FoundSource>& found);
  const Source* place(const Source& stored, const Placement& placement, double key);
  void note_missing(const OctreeTraversal::Node& node, double bound);

  void find_pages_ahead(double threshold);
  // Charges the work of traversals and shortlists first.
  bool is_exhausted();

  QueryContext context_;
  PageLoader& loader_;
  PageShortlists shortlists_;
  OctreeTraversal traversal_;  // of the last query
  NodeFronts fronts_;
  PageRequests requests_;
  std::vector<Pending> pending_;
  // Sources of instances where the level has them; the last query placed the first placed_count_.
  std::deque<Source> placed_;
  std::size_t placed_count_ = 0;
  ValidityRegion query_;  // the last one
  double threshold_ = 0;  // of the last query that was completed
  Totals totals_;
  Stage stage_ = Stage::kIdle;
};

}  // namespace clamor
