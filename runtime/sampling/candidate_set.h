// candidate_set.h: the sources whose priority reaches a threshold, and the k + 1 highest of them.
//
// find() queries the pool, and weigh() computes priorities without occlusion of all sources that
// are not known to be occluded and whose sounds are in memory. apply_occlusion() applies the
// visibilities that are known, and then tests the other candidates, highest first, until the k + 1
// highest are certain. keep_highest() leaves these.
//
// Threads: the sampler's alone.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/bands.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/propagation/intensity_kernel.h"
#include "runtime/query/source_pool.h"
#include "runtime/sampling/sampling_inputs.h"

namespace clamor {

struct Candidate {
  double priority, weight;
  double priority_per_weight;  // late boost over u
  std::uint32_t found;         // index of its source
  VisibilityCache::Index visibility = VisibilityCache::kUnknown;
  bool is_occlusion_applied = false;  // to priority and weight
  float share = 1;                    // of all that is heard (VisibilityCache::Wanted)
};

class CandidateSet {
 public:
  explicit CandidateSet(SamplingInputs& inputs) : inputs_(inputs) {}

  // Starts over with all sources whose priority may reach `threshold`. False, with some of them, if
  // there are more than `max_found` or if the budget is exhausted.
  bool find(double threshold, std::size_t max_found);

  // Makes candidates of the sources found whose priority is positive and at least `threshold`,
  // except those that are known to be occluded or whose sound is not in memory.
  void weigh(const SamplingMoment& moment, double threshold);

  // Applies visibilities, and drops candidates that are below the threshold or were not tested.
  // False if no rays were left for a candidate that matters, which then counts as occluded. There
  // must be a visibility cache.
  bool apply_occlusion(double threshold);

  // Keeps the `count` highest candidates as they were found, then the next one, whose priority is
  // returned. There must be more than `count`.
  double keep_highest(std::size_t count);

  // Puts the first `count` candidates in the order of the numbers under which they are heard.
  void sort_by_number(std::size_t count);

  // Sources whose priority reached the threshold of weigh(), occluded or not, without those that
  // the pool has culled by occlusion bounds.
  std::size_t reached() const { return reached_; }

  std::size_t size() const { return candidates_.size(); }
  const Candidate& operator[](std::size_t index) const { return candidates_[index]; }
  const FoundSource& source_of(const Candidate& candidate) const { return found_[candidate.found]; }
  VisibilityCache::Wanted wanted_of(const Candidate& candidate) const;
  // Fetches what is known of a candidate some way behind this one.
  void prefetch_visibility_after(std::size_t c) const;
  std::size_t found_count() const { return found_.size(); }

  // The sources whose visibility mattered, for VisibilityCache::refresh().
  std::span<const VisibilityCache::Wanted> wanted() const { return wanted_; }

  // The sounds of sources that would be candidates if their sounds were in memory.
  std::span<const WantedSound> unheard() const { return unheard_; }

 private:
  using BandSums = std::array<double, kBandCount>;
  using Ranked = std::pair<double, std::uint32_t>;  // priority and index of a candidate

  float share_of_sum(const Bands& weights, double scale) const;
  double scale_at_threshold(double weight, const FoundSource& found) const;
  bool comes_before(const Candidate& a, const Candidate& b) const;
  void prefetch(std::size_t first, std::size_t last) const;
  void weigh_source(std::uint32_t index, const ReceivedIntensity& received,
                    const SamplingMoment& moment, double threshold);
  void apply_known_visibilities();
  void renew_stale();
  void keep_highest_priorities();
  bool test_untested();
  void estimate_untested(std::size_t first, std::size_t last);
  double apply_visibility(std::uint32_t c);

  SamplingInputs& inputs_;
  std::size_t reached_ = 0;
  double threshold_ = 0;  // of weigh()
  // Weight of all that is heard, by band: by the last apply_occlusion() and, so far, by this one.
  BandSums heard_before_{}, heard_{};
  std::vector<FoundSource> found_;
  std::vector<Candidate> candidates_;
  std::vector<Bands> band_weights_;  // of the candidates, without occlusion
  std::vector<Ranked> untested_;     // candidates of unknown visibility
  std::vector<Ranked> stale_;        // candidates whose path a movable part has crossed
  std::vector<VisibilityCache::Wanted> renewed_;  // scratch memory of renew_stale()
  std::vector<double> highest_priorities_;        // up to k + 1 with visibilities, as a min-heap
  std::vector<VisibilityCache::Wanted> wanted_;
  std::vector<WantedSound> unheard_;
  std::vector<Ranked> ranked_;  // scratch memory of keep_highest()
};

}  // namespace clamor
