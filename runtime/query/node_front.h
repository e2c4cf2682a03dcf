// node_front.h: the nodes of an octree that can hold a source above the threshold wherever the
// listener will be for a while: a front through the tree, as collision detection keeps one through
// a BVH.
//
// A traversal costs a microsecond per node, of which there are thousands where lobes are sharp, and
// one keyframe later it would visit nearly the same. So a front is made for all places in a ball
// around the next steps, bit by bit in each keyframe, and while it holds a keyframe tests its nodes
// without traversing the tree. Pages that arrive are added; pages that are dropped end it. Levels
// with instances have no front: their sources are placed anew in each keyframe anyway.
//
// Threads: the sampler's alone.   Memory: 150 bytes per node.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/query/octree_traversal.h"
#include "runtime/query/page_shortlists.h"
#include "runtime/query/validity_region.h"
#include "runtime/streaming/page_loader.h"

namespace clamor {

class NodeFront {
 public:
  struct Node {
    OctreeTraversal::Node at;                  // `bound` holds in the whole region
    const ResidentPage* page = nullptr;        // null: it is missing
    PageLoader::CacheEntry* cached = nullptr;  // the page in the loader
    const Source* sources = nullptr;           // of the page
    std::uint32_t list = 0;                    // in the shortlists
  };
  // The region in which the result stays valid: no source of the node reaches the threshold there,
  // or its shortlist holds those that do.
  struct Result {
    ValidityRegion region;
    bool is_empty = true;
  };

  explicit NodeFront(QueryContext& context) : traversal_(context) {}

  void start(const ValidityRegion& region, const PageShortlists& lists);
  void clear();
  // Adds the next node of the traversal; false if there is none left.
  bool grow(PageLoader& loader, PageShortlists& lists);
  // Adds what is at and below nodes whose pages have arrived since.
  void add_arrived(PageLoader& loader, PageShortlists& lists);
  void forget_results() { results_.assign(nodes_.size(), {}); }
  // Looks the nodes' shortlists up again if some lists were dropped.
  void find_lists(PageShortlists& lists);

  bool is_started() const { return region().radius_m >= 0; }
  bool is_growing() const { return is_started() && !traversal_.is_done(); }
  bool holds(const ValidityRegion& query) const {
    return region().contains(query) && traversal_.is_done();
  }

  const ValidityRegion& region() const { return traversal_.region(); }
  const OctreeTraversal& traversal() const { return traversal_; }
  std::span<const Node> nodes() const { return nodes_; }
  std::span<Result> results() { return results_; }
  // Indices of the nodes whose results do not hold for the query.
  std::span<const std::uint32_t> find_due(const ValidityRegion& query);

 private:
  OctreeTraversal traversal_;
  std::vector<Node> nodes_;
  std::vector<Result> results_;  // of each node; apart, as every keyframe reads all of them
  std::vector<std::uint32_t> due_;
  std::uint32_t generation_ = 0;  // of the shortlists
  std::size_t missing_ = 0;       // nodes
};

// The front in use, and the next one, which is made before the first ends.
class NodeFronts {
 public:
  NodeFronts(QueryContext& context, PageLoader& loader, PageShortlists& lists)
      : context_(context), loader_(loader), lists_(lists), current_(context), next_(context) {}

  NodeFront& current() { return current_; }
  bool holds(const ValidityRegion& query) const { return current_.holds(query); }
  void forget() {
    current_.clear();
    next_.clear();
  }
  // After lists may have been dropped.
  void find_lists() {
    current_.find_lists(lists_);
    next_.find_lists(lists_);
  }
  // Adds pages that have arrived. Where others were dropped, a new front would at once ask for more
  // than fits: there is none for a while.
  void refresh();
  // Starts the next front, if the present one ends soon, for a listener who goes from the query's
  // place to `next_place`. Returns how many nodes to add to it in this keyframe.
  std::size_t prepare(const ValidityRegion& query, const Vec3& next_place);
  // Adds one; false if there is none to add. A complete front is then in use.
  bool grow();

 private:
  QueryContext& context_;
  PageLoader& loader_;
  PageShortlists& lists_;
  NodeFront current_, next_;
  std::uint32_t pause_ = 0;  // keyframes
};

}  // namespace clamor
