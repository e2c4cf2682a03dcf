// combined_pool.h: several pools as one, such as the sources of a level, images and moving sources.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "runtime/query/source_pool.h"

namespace clamor {

class CombinedPool final : public SourcePool {
 public:
  // Null pools are left out. A pool begins a keyframe, and is searched, after those before it.
  explicit CombinedPool(std::vector<SourcePool*> pools) : pools_(std::move(pools)) {
    std::erase(pools_, nullptr);
  }

  void charge(WorkBudget* budget) override {
    SourcePool::charge(budget);
    for (SourcePool* const pool : pools_) pool->charge(budget);
  }
  bool refresh() override {
    bool may_differ = false;
    for (SourcePool* const pool : pools_) may_differ |= pool->refresh();
    return may_differ;
  }
  void begin(const QueryKeyframe& keyframe) override {
    for (SourcePool* const pool : pools_) pool->begin(keyframe);
  }
  bool find_above(double threshold, std::size_t max_count,
                  std::vector<FoundSource>& found) override {
    for (std::uint32_t p = 0; p < pools_.size(); ++p) {
      const std::size_t before = found.size();
      if (!pools_[p]->find_above(threshold, max_count, found)) return false;
      for (FoundSource& one : std::span(found).subspan(before)) one.pool = p;
    }
    return found.size() <= max_count && !is_exhausted();
  }
  double upper_bound() override {
    double highest = 0;
    for (SourcePool* const pool : pools_) highest = std::max(highest, pool->upper_bound());
    return highest;
  }
  double missing_key(const FoundSource& found, double threshold) override {
    return pools_[found.pool]->missing_key(found, threshold);
  }
  void request_pages(double threshold) override {
    for (SourcePool* const pool : pools_) pool->request_pages(threshold);
  }
  bool lacks_pages() const override {
    return std::ranges::any_of(pools_, &SourcePool::lacks_pages);
  }
  bool complete() override {
    bool is_complete = true;
    for (SourcePool* const pool : pools_) is_complete &= pool->complete();
    return is_complete;
  }
  std::uint64_t size() const override {
    std::uint64_t sum = 0;
    for (const SourcePool* const pool : pools_) sum += pool->size();
    return sum;
  }

 private:
  std::vector<SourcePool*> pools_;
};

}  // namespace clamor
