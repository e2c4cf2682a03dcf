// disjoint_sets.h: a union-find forest over n items.
//
// The lowest index of a set is its root, so the result does not depend on the order of joins.
// R. E. Tarjan. Efficiency of a good but not linear set union algorithm. J. ACM 22(2), 1975; with
// path halving.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace clamor {

template <class Index>
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), Index{0});
  }

  Index root_of(Index i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  void join(Index a, Index b) {
    a = root_of(a);
    b = root_of(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

  // Root of every item.
  std::vector<Index> roots() {
    for (std::size_t i = 0; i < parent_.size(); ++i) parent_[i] = root_of(static_cast<Index>(i));
    return parent_;
  }

 private:
  std::vector<Index> parent_;
};

}  // namespace clamor
