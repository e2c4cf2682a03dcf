// source_pool.h: where the sampler finds sources: a list, or an octree whose pages come and go.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/listener.h"
#include "common/vec.h"
#include "runtime/occlusion/occlusion_upper_bounds.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/propagation/source_page.h"
#include "runtime/propagation/tolerances.h"
#include "runtime/query/work_budget.h"

namespace clamor {

// A source where the level has it, though it may be stored in a tree that has instances.
struct FoundSource {
  const Source* source = nullptr;
  std::uint64_t number = 0;
  std::uint32_t signal = 0;
  std::uint32_t frame = 0;  // of the pool
  // Factor of its priority by the late boost (late_boost.h).
  float boost = 1;
  // Upper bound of its priority at any time.
  double upper_bound = std::numeric_limits<double>::infinity();
  // A moving source is heard under this number and its occlusion is known under `number`; 0: one
  // number for both. `velocity_mps` is that at `source`, the place that its sound left.
  std::uint64_t voice = 0;
  Vec3f velocity_mps{};
  double start_s = 0;      // of a moving source's sound, on top of the source's delay
  double min_scale = 1;    // of its power, if it stands for others of its group
  float openness = 1;      // share of its power that the portals on its path let through
  std::uint32_t pool = 0;  // of a CombinedPool, that has found it
};

// The late boost of a source, and the upper bound of its priority, whose culler assumed `max_boost`
// at full strength.
struct BoostedBound {
  BoostedBound(float max_boost, float strength, double max_bound)
      : boost(1 + strength * max_boost),
        upper_bound(max_bound * (1 + query::kBoostSlack) * static_cast<double>(boost) /
                    (1 + static_cast<double>(max_boost))) {}
  float boost;
  double upper_bound;
};

// All queries of a keyframe share it.
struct QueryKeyframe {
  Listener listener;
  double time_s = 0;
  // Upper bounds of what gets past occluders: sources that cannot reach the threshold behind them
  // need not be found. Null: nothing is occluded.
  const OcclusionUpperBounds* occlusion = nullptr;
  float late_boost = 1;  // strength, 0 to 1 (late_boost.h)

  const Vec3& place_m() const { return listener.position_m; }
  // Where a listener who goes on like this will be when pages that are requested now are heard.
  Vec3 place_ahead_m() const {
    return listener.position_m + query::kPageLookAhead_s * listener.velocity_mps;
  }
};

// Sources to sample from. Each keyframe calls refresh() and begin(), then find_above() once or more
// often, then request_pages(). Threads: the sampler's alone.
class SourcePool {
 public:
  virtual ~SourcePool() = default;

  // Charges all queries to a budget, which must outlive the pool or be taken back.
  virtual void charge(WorkBudget* budget) { budget_ = budget; }

  // Takes in what was loaded; sources found before become invalid. True if a sample at the same
  // place might differ from the last.
  virtual bool refresh() { return false; }

  // Begins a keyframe: signals that are silent then raise no bound.
  virtual void begin(const QueryKeyframe& keyframe) { keyframe_ = keyframe; }

  // Appends every source in memory whose priority is at least `threshold`, and a few more. False,
  // and incomplete, where there are more than `max_count` or the budget is exhausted.
  virtual bool find_above(double threshold, std::size_t max_count,
                          std::vector<FoundSource>& found) = 0;

  // Upper bound of all priorities; 0 where finding all sources is cheap.
  virtual double upper_bound() { return 0; }

  // Upper bound of the key (power over u) of sources that are missing around one that was found,
  // which stands for them. 0 where everything that could reach `threshold` is in memory.
  virtual double missing_key(const FoundSource& /*found*/, double /*threshold*/) { return 0; }

  // Requests the pages that the last query lacked, the most important first, and those that will be
  // needed at place_ahead_m().
  virtual void request_pages(double /*threshold*/) {}

  // Did the last query lack a page?
  virtual bool lacks_pages() const { return false; }

  // True once everything that was requested is in memory; waits for more of it otherwise.
  virtual bool complete() { return true; }

  // Number of sources, in memory or not.
  virtual std::uint64_t size() const = 0;

 protected:
  const QueryKeyframe& keyframe() const { return keyframe_; }
  void spend(std::uint64_t units) {
    if (budget_ != nullptr) budget_->spend(units);
  }
  bool is_exhausted() const { return budget_ != nullptr && budget_->is_exhausted(); }

 private:
  QueryKeyframe keyframe_;
  WorkBudget* budget_ = nullptr;
};

// A list of sources, all in memory, numbered from `first_number` on.
class SourceList final : public SourcePool {
 public:
  SourceList(const RadiationModel& radiation, const SignalWeights& weights,
             std::vector<Source> sources, std::uint64_t first_number = 0)
      : radiation_(radiation),
        page_(radiation, weights.by_signal, std::move(sources)),
        first_number_(first_number) {}

  bool find_above(double threshold, std::size_t /*max_count*/,
                  std::vector<FoundSource>& found) override {
    const std::size_t before = found.size();
    page_.cull(keyframe().place_m(), 0, threshold, culled_);
    for (std::size_t s = 0; s < culled_.count; ++s) SourcePage::prefetch(page_[culled_.index[s]]);
    for (std::size_t s = 0; s < culled_.count; ++s) {
      const Source& source = page_[culled_.index[s]];
      const BoostedBound boosted(radiation_.late_boost().at(source.delay_s), keyframe().late_boost,
                                 static_cast<double>(culled_.upper_bound[s]));
      if (boosted.upper_bound >= threshold)
        found.push_back({&source, first_number_ + culled_.index[s], radiation_.signal(source), 0,
                         boosted.boost, boosted.upper_bound});
    }
    spend(WorkBudget::kFound * (found.size() - before) + page_.size() / 8);
    return true;
  }
  std::uint64_t size() const override { return page_.size(); }
  const SourcePage& page() const { return page_; }

 private:
  const RadiationModel& radiation_;
  const SourcePage page_;
  const std::uint64_t first_number_;
  CulledPage culled_;
};

}  // namespace clamor
