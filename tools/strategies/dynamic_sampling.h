// dynamic_sampling.h: a sample that persists over keyframes and adapts as weights change (the
// paper, section 3.4).
//
// The first sample is drawn by importance (importance_sampling.h). Then the rule decides:
//
//   once        The sample stays. A source drawn with P_i keeps its factor 1 / P_i: unbiased
//               wherever the listener goes, but noisier with the distance.
//   full        The whole sample is redrawn every `redraw_s`.
//   stochastic  A share q is exchanged per second: chosen sources leave one after the other, each
//               drawn with equal probability, and unused ones come in by importance.
//   adaptive    A source whose weight has fallen by a factor epsilon since it was drawn is
//               exchanged. If a weight has grown by epsilon, another source, drawn with equal
//               probability from the rest, is exchanged, "to avoid a systematic bias".
//
// The factor of stochastic and adaptive is 1 / P_i with the current P_i. Each source then stands
// for the same part of the sum, and the total loudness is right at any moment, while the
// composition lags behind. (With the P_i of the drawing, a source that the listener approaches
// would be far too loud.)
//
// Sources come in with the odds P_i / (1 - P_i), since they may be in already. Exchanging one at a
// time, with the leaving source among the candidates, is a reversible Markov chain, in which sets
// have probabilities in proportion to the product of their odds. Source i is then in with
// probability P_i up to a term of order 1 / k. (X.-H. Chen, A. P. Dempster, J. S. Liu. Weighted
// Finite Population Sampling to Maximize Entropy. Biometrika 81, 1994. J. Hajek. Asymptotic Theory
// of Rejective Sampling. Ann. Math. Statist. 35, 1964.)
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tools/strategies/importance_sampling.h"

namespace clamor {

// Parameters of the paper's strategies, with the paper's values.
struct StrategyTuning {
  std::uint64_t seed = 1;
  double redraw_s = 1;            // full: time between samples
  double exchange_per_s = 0.2;    // stochastic: q
  double epsilon = 1.25;          // adaptive: 1.1 to 1.5
  int candidates_per_voice = 10;  // octree-diffusion
};

class DynamicSample {
 public:
  // A source that may be chosen.
  struct Candidate {
    std::uint64_t number = 0;
    double weight = 0;
  };
  struct Choice {
    std::uint32_t candidate = 0;  // index
    double factor = 1;            // scale factor that makes sums unbiased
  };

  enum class Rule { kOnce, kFull, kStochastic, kAdaptive };

  DynamicSample(Rule rule, std::size_t k, const StrategyTuning& tuning)
      : rule_(rule), k_(k), tuning_(tuning) {}

  // The sample of the next keyframe, sorted by candidate; valid until the next call. Candidates
  // must be sorted by number. Chooses k of them, or all with a positive weight if there are fewer.
  // O(n).
  std::span<const Choice> next(std::span<const Candidate> candidates);

 private:
  struct Member {
    std::uint32_t candidate = 0;
    std::uint64_t number = 0;
    double weight = 0;       // when it was drawn
    double probability = 0;  // when it was drawn
  };

  void draw_anew();
  void find_members();
  void exchange_by_share(Draws& draws);
  void exchange_by_change(Draws& draws);
  void leave(std::size_t member);
  void enter(std::uint32_t candidate);
  void fill(Draws& draws);

  const Rule rule_;
  const std::size_t k_;
  const StrategyTuning tuning_;
  std::uint64_t keyframes_ = 0;
  double due_ = 0;  // pending exchanges, with a fraction
  std::span<const Candidate> candidates_;
  std::vector<double> weights_, probabilities_;
  std::vector<double> odds_to_;  // cumulative sums over the candidates
  std::vector<char> used_;
  std::vector<Member> members_;
  std::vector<Choice> sample_;
};

}  // namespace clamor
