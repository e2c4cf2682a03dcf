// threshold_search.h: finds the threshold that k + 1 candidates reach, and these candidates.
//
// Each step queries the pool with a threshold and counts the candidates that reach it. The first
// threshold is predicted from previous samples; that of the first sample is the pool's upper bound,
// or 0 if the pool has no more than k sources. After a sample that had all audible sources, all are
// asked for at once. sampler.h says what ends a search early.
//
// Threads: the sampler's alone.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>

#include "runtime/sampling/candidate_set.h"
#include "runtime/sampling/sampler.h"
#include "runtime/sampling/sampling_inputs.h"
#include "runtime/sampling/threshold_predictor.h"

namespace clamor {

class ThresholdSearch {
 public:
  // All arguments must outlive the search.
  ThresholdSearch(SamplingInputs& inputs, CandidateSet& candidates, SearchBound bound)
      : inputs_(inputs), candidates_(candidates), bound_(bound) {}

  // Starts over for another sample. Without this, run() continues a search that waits for pages.
  void restart(bool has_moved);

  struct Result {
    double threshold = 0;
    bool ended_by_budget = false;
  };
  // Leaves the k + 1 highest candidates, the lowest last, and returns that one's priority; or all
  // that reach the threshold that it returns, if they are fewer.
  Result run(const SamplingMoment& moment);

  // Whether an exact search waits for pages: it estimates visibilities only once none is missing,
  // so that the sample does not depend on when pages arrive.
  bool waits_for_pages() const;
  // No more pages arrive for this place: choose from what is in memory.
  void stop_waiting() { stopped_waiting_ = true; }

  // Scales the prediction to another sample size.
  void rescale(std::size_t from_voices, std::size_t to_voices) {
    predictor_.rescale(from_voices, to_voices);
  }

 private:
  // The lowest threshold tried with too few candidates, and the highest with far too many.
  struct Bracket {
    double threshold = 0;  // the next to try
    double too_high = std::numeric_limits<double>::infinity(), too_low = 0;
    bool is_unlimited = false;
    int near_misses = 0;
  };

  // With a visibility cache, the threshold is lowered by at most this factor at a time.
  static constexpr double kMaxOcclusionStep = 4;

  Result search(const SamplingMoment& moment);
  Result search_within_budget(const SamplingMoment& moment);
  double first_threshold() const;
  double lowered_after_miss(double threshold) const;
  double lowered(double threshold);
  bool is_complete(double threshold) const;
  bool apply_occlusion(double threshold);
  std::size_t max_found() const;
  std::size_t max_examined() const;

  SamplingInputs& inputs_;
  CandidateSet& candidates_;
  const SearchBound bound_;
  ThresholdPredictor predictor_, restarted_predictor_;  // now, and at the last restart
  std::optional<Bracket> paused_;                       // a search that waits for pages
  bool stopped_waiting_ = false;
  double last_found_ = 0, last_step_ = kMaxOcclusionStep;  // of lowered()
};

}  // namespace clamor
