// strategies.h: the ways to choose sources, by name: the paper's, and priority, which replaces
// them.
//
//   name                  paper    what it does
//   priority              -        the k highest w_i / u_i (sampler.h), streamed; the default
//   all                   -        no sampling: every source
//   random                3.3      k sources, each as likely as any other
//   importance            3.3-3.4  k sources in proportion to their weight at the first place
//   full-resampling       3.4      importance, all anew every second
//   stochastic-diffusion  3.4      importance, a share q exchanged per second
//   adaptive-diffusion    3.4      importance, exchanged as weights change by a factor epsilon
//   octree                3.5      a cut through the tree of representatives
//   octree-diffusion      3.5      a larger cut, and adaptive-diffusion among what is in it
//
// All but priority take the whole list of sources; those of 3.3 and 3.4 weigh it at each keyframe.
// They are here to learn from and to be compared with. Same seed, same sample.
//
// What a chosen source is scaled by, so that sums are right on average over all drawings:
//
//   power      its power by 1 / P_i, its amplitude by the root of that. Loudness is right.
//   amplitude  its amplitude by 1 / P_i, as the paper does. The waveform is right on average, and
//              for sounds that are not copies of each other each drawing is too loud: with
//              P_i = k A_i / sum A, A_i the amplitudes, its power is sum A_i^2 / P_i, that is,
//              N_eff / k times the true one, N_eff = (sum A)^2 / sum A^2, as long as k is small
//              before N_eff. (Drawn with replacement, as in equation 3, 1 + (N_eff - 1) / k times.)
//              Drawn evenly, n / k times; by the octree, in the paper's scenes, 3 to 6 dB more than
//              N_eff / k, since its nodes weigh what is radiated and not what is heard of it.
//
// Weights are powers for the one and their roots for the other: each makes its own error least.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>

#include "common/result.h"
#include "runtime/sampling/dynamic_sampling.h"
#include "runtime/sampling/sampler.h"
#include "runtime/streaming/prepared_signal.h"

namespace clamor {

class MovingSourceList;

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

inline constexpr int kMaxVoices = 1'000'000;  // ten times what a core mixes

struct StrategyOptions {
  std::string strategy = "priority";
  std::size_t voices = 2000;  // "all" takes every source
  Estimator estimator = Estimator::kPower;
  StrategyTuning tuning{};
  SearchBound bound = SearchBound::kUnbounded;  // of priority
};

// An Error that names what there is, or the range that was left.
Result<void> check(const StrategyOptions& options);

// Does it need a list of all sources? If not, any pool will do.
inline bool needs_list(const std::string& strategy) { return strategy != "priority"; }

// Signals as the paper's strategies know them, by their mean power only.
SignalWeights mean_weights(std::span<const PreparedSignal> signals);

// Does it know of sources that move?
inline bool takes_moving(const std::string& strategy) {
  return strategy == "priority" || strategy == "all";
}

// Does it ask what hides a source? The paper's own strategies know nothing of that.
inline bool uses_occlusion(const std::string& strategy) {
  return strategy == "priority" || strategy == "all";
}

// What the options, which are right, ask for. All must outlive the sampler.
std::unique_ptr<Sampler> make_sampler(const StrategyOptions& options, const RadiationModel& field,
                                      const SignalWeights& weights, SourceList& list,
                                      VisibilityCache* occlusion = nullptr,
                                      MovingSourceList* moving = nullptr);

// Of a strategy that needs no list. Moving sources are in the pool (moving_source_list.h).
std::unique_ptr<Sampler> make_sampler(const StrategyOptions& options, const RadiationModel& field,
                                      const SignalWeights& weights, SourcePool& pool,
                                      VisibilityCache* occlusion = nullptr);

}  // namespace clamor
