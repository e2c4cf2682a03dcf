// source_pool.h: where the sampler looks for sources: a list, or an octree whose pages come and go.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/occlusion_upper_bounds.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/signal_weights.h"
#include "runtime/query/source_page.h"
#include "runtime/query/work_budget.h"

namespace clamor {

// A source where the level has it, though it may be stored as one of a copied tree.
struct FoundSource {
  const Source* source = nullptr;
  std::uint64_t number = 0;
  std::uint32_t signal = 0;
  std::uint32_t copy = 0;  // the pool's
  // Its priority is so many times what weight and u alone make it (late_boost.h).
  float boost = 1;
  // Of its priority at any time.
  double ceiling = std::numeric_limits<double>::infinity();
  // Of one that moves: the number it is heard under, `number` being what looks at it are kept
  // under; and how fast it was at the place that sound left, which is the source's.
  std::uint64_t voice = 0;  // 0: as `number`
  Vec3f velocity_mps{};
};

// The boost of a source whose page was sifted as if it had all of it, and what is left of the
// sieve's ceiling.
struct BoostedBound {
  BoostedBound(float most, float strength, double most_ceiling)
      : boost(1 + strength * most),
        ceiling(most_ceiling * (1 + 1e-6) * static_cast<double>(boost) /
                (1 + static_cast<double>(most))) {}
  float boost;
  double ceiling;
};

// Not thread-safe: the sampler's alone.
class SourcePool {
 public:
  virtual ~SourcePool() = default;

  // Charges all look-ups to a budget, which must outlive the pool or be taken back.
  virtual void charge(WorkBudget* budget) { budget_ = budget; }

  // Called before the look-ups of a sample; what was found before is no longer valid. `true` if a
  // sample at the same place might differ from the last.
  virtual bool refresh() { return false; }

  // A sample is wanted at a place and time: what may be left out now need not be told from what is
  // never heard.
  virtual void begin(const Vec3& /*place*/, double /*time_s*/) {}

  // Upper bounds of what gets past occluders: sources that cannot reach the threshold behind them
  // need not be found. Null: nothing is occluded.
  virtual void set_occlusion_bounds(const OcclusionUpperBounds* /*bounds*/) {}
  // How strongly late sources are boosted from now on, 0 to 1 (late_boost.h).
  virtual void set_late_boost(float /*strength*/) {}

  // Appends every source that is here and whose priority at `place`, its signal being as loud as it
  // ever is, is at least `threshold`, and a few more. Gives up, and returns false, where there are
  // more than `most`, or where the budget is exhausted.
  virtual bool look(const Vec3& place, double threshold, std::size_t most,
                    std::vector<FoundSource>& found) = 0;

  // No priority at `place` is higher; 0 where looking for all of them is no trouble.
  virtual double highest(const Vec3& /*place*/) { return 0; }

  // The highest static key (power over u) that a source of the same kind might have and not be
  // here: one that is here stands for these too. 0 where all that could reach `tau` is here.
  virtual double unseen_key(const FoundSource& /*found*/, double /*tau*/) { return 0; }

  // Asks for what the last look would have needed, the most important first, and for what a
  // listener would need who is soon at `soon`.
  virtual void ask(const Vec3& /*soon*/, double /*tau*/) {}

  // Was something not here that the last look would have needed?
  virtual bool missed() const { return false; }

  // Is everything here that was asked for? If not, waits for it.
  virtual bool complete() { return true; }

  // Of sources, here or not.
  virtual std::uint64_t size() const = 0;

 protected:
  void spend(std::uint64_t units) {
    if (budget_ != nullptr) budget_->spend(units);
  }
  bool is_exhausted() const { return budget_ != nullptr && budget_->is_exhausted(); }

 private:
  WorkBudget* budget_ = nullptr;
};

// All of a list, always here.
class SourceList final : public SourcePool {
 public:
  SourceList(const RadiationModel& field, const SignalWeights& weights, std::vector<Source> sources)
      : field_(field), page_(field, weights.by_signal, std::move(sources)) {}

  bool look(const Vec3& place, double threshold, std::size_t /*most*/,
            std::vector<FoundSource>& found) override {
    const std::size_t before = found.size();
    page_.pass(place, threshold, [&](std::size_t index, double ceiling) {
      const Source& source = page_[index];
      const BoostedBound boosted(field_.late_boost().at(source.delay_s), strength_, ceiling);
      if (boosted.ceiling >= threshold)
        found.push_back({&source, index, field_.signal(source), 0, boosted.boost, boosted.ceiling});
    });
    spend(WorkBudget::kFound * (found.size() - before) + page_.size() / 8);
    return true;
  }
  void set_late_boost(float strength) override { strength_ = strength; }
  std::uint64_t size() const override { return page_.size(); }
  const SourcePage& page() const { return page_; }

 private:
  const RadiationModel& field_;
  const SourcePage page_;
  float strength_ = 1;
};

}  // namespace clamor
