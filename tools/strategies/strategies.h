// strategies.h: sampling strategies by name: the paper's, all sources, and priority sampling.
//
//   name                  paper    what it does
//   priority              -        the k highest w_i / u_i (sampler.h), streamed; the default
//   all                   -        no sampling: every source
//   random                3.3      k sources with equal probability
//   importance            3.3-3.4  k sources in proportion to their weight at the first place
//   full-resampling       3.4      importance, redrawn every second
//   stochastic-diffusion  3.4      importance, a share q exchanged per second
//   adaptive-diffusion    3.4      importance, exchanged as weights change by a factor epsilon
//   octree                3.5      a cut through the tree of representatives
//   octree-diffusion      3.5      a larger cut, and adaptive-diffusion among its sources
//
// All but priority need the whole list of sources; those of 3.3 and 3.4 compute all weights at each
// keyframe. They are here for comparison and study. The same seed gives the same sample.
//
// Chosen sources are scaled so that sums are right on average over all drawings:
//
//   power      power by 1 / P_i, amplitude by the root of that. Loudness is right.
//   amplitude  amplitude by 1 / P_i, as in the paper. The waveform is right on average, but a
//              drawing of sounds that are not copies of each other is too loud. With
//              P_i = k A_i / sum A for amplitudes A_i, its power is sum A_i^2 / P_i, which is
//              N_eff / k times the true one, N_eff = (sum A)^2 / sum A^2, for k small against
//              N_eff. (Drawn with replacement, as in equation 3, 1 + (N_eff - 1) / k times.) With
//              equal probabilities it is n / k times; with the octree, in the paper's scenes, 3 to
//              6 dB above N_eff / k, since its nodes are weighted by radiated and not by received
//              power.
//
// Weights are powers for the former and their roots for the latter, which minimises the error of
// each.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "common/result.h"
#include "runtime/query/work_budget.h"
#include "runtime/sampling/sampling_strategy.h"
#include "tools/strategies/dynamic_sampling.h"

namespace clamor {

enum class Estimator { kPower, kAmplitude };

struct StrategyInfo {
  const char* name;
  const char* section;  // of the paper; "" if it is not from there
};
inline constexpr std::array<StrategyInfo, 9> kStrategies = {{{"priority", ""},
                                                             {"all", ""},
                                                             {"random", "3.3"},
                                                             {"importance", "3.3-3.4"},
                                                             {"full-resampling", "3.4"},
                                                             {"stochastic-diffusion", "3.4"},
                                                             {"adaptive-diffusion", "3.4"},
                                                             {"octree", "3.5"},
                                                             {"octree-diffusion", "3.5"}}};

struct StrategyOptions {
  std::string strategy = "priority";
  std::size_t voices = 2000;  // "all" takes every source
  Estimator estimator = Estimator::kPower;
  StrategyTuning tuning{};
  SearchBound bound = SearchBound::kUnbounded;  // of priority
};

// Errors list the strategies that exist, or give the valid range.
Result<void> check(const StrategyOptions& options);

// Returns whether a strategy needs a list of all sources; otherwise any pool will do.
inline bool needs_list(const std::string& strategy) { return strategy != "priority"; }

// Returns whether a strategy samples moving sources, and whether it knows of occlusion. The paper's
// do neither.
inline bool takes_moving(const std::string& strategy) {
  return strategy == "priority" || strategy == "all";
}
inline bool uses_occlusion(const std::string& strategy) {
  return strategy == "priority" || strategy == "all";
}

// A strategy for AuralizerOptions, which give the number of voices and the bound. `options` must
// have passed check().
std::shared_ptr<const SamplingStrategy> make_strategy(const StrategyOptions& options);
std::shared_ptr<const SamplingStrategy> make_strategy(const std::string& name);

// The sampler of options that have passed check(). Everything must outlive it.
std::unique_ptr<Sampler> make_sampler(const StrategyOptions& options,
                                      const RadiationModel& radiation, const SignalWeights& weights,
                                      SourceList& list, VisibilityCache* occlusion = nullptr,
                                      MovingSourceList* moving = nullptr);

// For strategies that need no list. Moving sources are in the pool (moving_source_list.h).
std::unique_ptr<Sampler> make_sampler(const StrategyOptions& options,
                                      const RadiationModel& radiation, const SignalWeights& weights,
                                      SourcePool& pool, VisibilityCache* occlusion = nullptr);

}  // namespace clamor
