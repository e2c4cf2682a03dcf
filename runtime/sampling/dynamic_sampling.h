// dynamic_sampling.h: a sample that is kept from keyframe to keyframe and adapts as weights change.
//
// (The paper, section 3.4.) The first sample is drawn by importance (importance_sampling.h). Then
//
//   once        it stays. What was drawn with P_i keeps its factor 1 / P_i: unbiased wherever the
//               listener goes, and the noisier the farther.
//   full        all of it is drawn anew every `redraw_s`.
//   stochastic  a share q of it is exchanged each second: one chosen source after the other leaves,
//               each drawn evenly, and one of the unused ones comes in by importance.
//   adaptive    a source whose weight has fallen by a factor epsilon since it was drawn is
//               exchanged. For one whose weight has grown by epsilon another one, drawn evenly
//               from the rest, is exchanged, "to avoid a systematic bias".
//
// The factor of stochastic and adaptive is 1 / P_i for the P_i of now. So each source of the sample
// stands for the same part of the sum, and the whole is as loud as it should be at any moment; what
// the parts are made of lags behind by what has not been exchanged yet. (With the P_i of
// when it was drawn, a source that the listener comes near would be far too loud.)
//
// Who comes in is drawn with the odds P_i / (1 - P_i), because he may not be in yet. Exchanging one
// at a time, the one who left among the candidates, is then a reversible Markov chain whose
// sets have probabilities in proportion to the product of their odds; in these, i is with
// probability P_i but for a term of order 1 / k. (X.-H. Chen, A. P. Dempster, J. S. Liu.
// Weighted Finite Population Sampling to Maximize Entropy. Biometrika 81, 1994. J. Hajek.
// Asymptotic Theory of Rejective Sampling. Ann. Math. Statist. 35, 1964.)
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/sampling/importance_sampling.h"

namespace clamor {

// How the paper's strategies may be tuned; the values are the paper's.
struct StrategyTuning {
  std::uint64_t seed = 1;
  double redraw_s = 1;            // full: time from one sample to the next
  double exchange_per_s = 0.2;    // stochastic: q
  double epsilon = 1.25;          // adaptive: 1.1 to 1.5
  int candidates_per_voice = 10;  // octree-diffusion
};

// What may be chosen.
struct Candidate {
  std::uint64_t number = 0;
  double weight = 0;
};

struct ChosenCandidate {
  std::uint32_t candidate = 0;  // index
  double factor = 1;            // to scale by, so that sums are right on average
};

class DynamicSample {
 public:
  enum class Rule { kOnce, kFull, kStochastic, kAdaptive };

  DynamicSample(Rule rule, std::size_t k, const StrategyTuning& tuning)
      : rule_(rule), k_(k), tuning_(tuning) {}

  // The sample of the next keyframe, by ascending candidate; valid until the next call. Candidates
  // come by ascending number. k of them are chosen if so many have a weight above zero. O(n).
  std::span<const ChosenCandidate> next(std::span<const Candidate> candidates);

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
  double due_ = 0;  // exchanges that are due, and less than one
  std::span<const Candidate> candidates_;
  std::vector<double> weights_, probabilities_;
  std::vector<double> odds_to_;  // summed over the candidates up to and including each
  std::vector<char> used_;
  std::vector<Member> members_;
  std::vector<ChosenCandidate> sample_;
};

}  // namespace clamor
