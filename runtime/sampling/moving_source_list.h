// moving_source_list.h: moving sources as the sampler chooses among them: with the octree's, in one
// ranking.
//
// A flat list with a permanent u each. At each keyframe all are put where they are at its moment.
// A source is weighed, hidden and heard where it was when what arrives now left it
// (position_history.h), which is found for those that may reach a threshold. These pass one sieve,
// distance against highest weight, in vectors, since nothing is much nearer than it was:
// a keyframe of 100 000, all moving, of which 2000 are chosen takes 2.1 ms of one core, of 10 000
// 0.5 ms (tests/benchmarks/moving_sources_benchmark.cpp).
//
// What hides a source is known for where it was (visibility_cache.h): its number there changes with
// the cell it is in, an eighth of its distance to the listener wide, and within that it is looked
// at again as it moves. What walls let through is heard of it, as the bake has it of what stands
// still.
//
// Threads: the sampler's alone.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/source_number.h"
#include "runtime/query/source_pool.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/sampling/position_history.h"

namespace clamor {

class MovingSourceList {
 public:
  // The kinds are the last of the field's emitters; `weights` are per signal, at its loudest. All
  // must outlive the list.
  MovingSourceList(MovingSources& sources, const RadiationModel& field,
                   std::span<const Bands> weights, std::span<const Emitter> emitters,
                   std::size_t kinds);

  // Takes what was committed; true if a sample might differ from the last.
  bool refresh();

  // Puts all where they are at a time, for a listener at `place`.
  void begin(const Vec3& place, double time_s);

  // As SourcePool's.
  void look(const Vec3& place, double threshold, std::vector<FoundSource>& found);
  double highest(const Vec3& place) const;

  std::size_t most() const { return sources_.most(); }

 private:
  void tune(std::size_t place, double time_s);
  void put_all(double time_s);
  void find_emission(std::size_t place, const Vec3& listener_m);

  MovingSources& sources_;
  const RadiationModel& field_;
  const std::span<const Bands> weights_;
  const std::span<const Emitter> kinds_;
  const std::uint32_t first_emitter_;
  const MovingSources::Snapshot* now_ = nullptr;
  std::uint64_t commits_ = 0;     // of now_
  double taken_s_ = 0;            // the moment that positions are of
  std::optional<double> time_s_;  // of the last sample
  bool fresh_ = false;            // not used yet
  bool in_motion_ = false;

  // By place.
  std::vector<Source> heard_;
  std::vector<std::uint32_t> versions_, generations_;
  std::vector<float> x_m_, y_m_, z_m_;   // at time_s_
  std::vector<float> highest_;           // priority at 1 m, on the axis; -1: there is none
  std::vector<Vec3f> velocity_mps_;      // of heard_, where sound left it,
  std::vector<std::uint32_t> found_in_;  // if it was looked for in this begun_
  std::uint32_t begun_ = 0;
  PositionHistory trails_;
  std::vector<std::uint32_t> restarts_;  // sources that are new
};

// Moving sources and others.
class CombinedPool final : public SourcePool {
 public:
  CombinedPool(SourcePool& still, MovingSourceList& moving) : still_(still), moving_(moving) {}

  void charge(WorkBudget* budget) override {
    SourcePool::charge(budget);
    still_.charge(budget);
  }
  bool refresh() override {
    const bool changed = moving_.refresh();
    return still_.refresh() || changed;
  }
  void begin(const Vec3& place, double time_s) override {
    still_.begin(place, time_s);
    moving_.begin(place, time_s);
  }
  void set_occlusion_bounds(const OcclusionUpperBounds* hidden, bool may_lag) override {
    still_.set_occlusion_bounds(hidden, may_lag);
  }
  void set_late_boost(float strength) override { still_.set_late_boost(strength); }
  bool look(const Vec3& place, double threshold, std::size_t most,
            std::vector<FoundSource>& found) override;
  double highest(const Vec3& place) override;
  double unseen_key(const FoundSource& found, double tau) override {
    return found.voice == 0 ? still_.unseen_key(found, tau) : 0;
  }
  void ask(const Vec3& soon, double tau) override { still_.ask(soon, tau); }
  bool missed() const override { return still_.missed(); }
  bool complete() override { return still_.complete(); }
  std::uint64_t size() const override { return still_.size() + moving_.most(); }

 private:
  SourcePool& still_;
  MovingSourceList& moving_;
};

}  // namespace clamor
