// octree_pool.h: the sources of a heap-ordered octree (source_octree.h) whose pages may be missing.
//
// A look-up walks down from the root and leaves out a node where
//
//   highest key x most that a power of 1 can weigh / (distance to its bounds)^2 < threshold,
//
// or where its emission cone points away: nothing in it or below can reach the threshold. The nodes
// are always in memory, so what is missing is known by its bound, and is asked for in that order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/source_octree.h"
#include "runtime/page_loader.h"
#include "runtime/source_pool.h"

namespace clamor {

class OctreePool final : public SourcePool {
 public:
  // Page i of the loader belongs to node i. All must outlive the pool. Fetches the root's page.
  OctreePool(const SourceField& field, const SignalWeights& weights,
             std::span<const OctreeNode> nodes, std::uint64_t sources, PageLoader& loader);

  bool refresh() override { return loader_.begin_sample(); }
  void look(const Vec3& place, double threshold, std::vector<FoundSource>& found) override;
  double unseen_key(const FoundSource& found, const Vec3& place, double tau) override;
  void ask(const Vec3& soon, double tau) override;
  bool complete() override;
  std::uint64_t size() const override { return sources_; }

  std::uint64_t nodes_visited() const { return visited_; }  // by all looks so far

 private:
  // Most that a priority in the node or below it can be.
  double bound(std::uint32_t node, const Vec3& place) const;
  // Appends pages that are missing and could hold priorities of tau, as seen from `place`.
  void add_missing(const Vec3& place, double tau, bool needed,
                   std::vector<WantedPage>& wanted) const;

  const SourceField& field_;
  const std::span<const OctreeNode> nodes_;
  const std::uint64_t sources_;
  const double most_per_power_;
  PageLoader& loader_;
  OctreeCube root_;
  std::vector<std::uint32_t> to_visit_;
  Vec3 place_{};  // of the last look
  bool missed_ = false;
  bool asked_ = false;
  std::uint64_t visited_ = 0;
};

}  // namespace clamor
