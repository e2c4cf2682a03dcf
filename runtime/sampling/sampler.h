// sampler.h: which sources are heard at a place, each with the factor its power is scaled by.
//
// The weight of a source is what the ear would miss: w_i = sum_b loudness_b x signal_b x I_ib x
// e_ib, with loudness_b from BS.1770 (loudness.h), signal_b the mean square in the band of what it
// plays, with the level around the moment that is heard (signal_weights.h), I_ib its intensity at
// the place (radiation_model.h) and e_ib what the receivers hear of it from its direction
// (reception.h). What is silent now weighs nothing and is not taken.
//
// "all" takes every source as it is. "priority" takes the k of highest priority w_i / u_i, u_i
// being permanent, and scales their power by max(1, tau / w_i), tau the (k+1)-th priority: unbiased
// in power, and the choice changes only as far as the weights do. (N. Duffield, C. Lund, M. Thorup.
// Priority sampling for estimation of arbitrary subset sums. J. ACM 54(6), 2007. E. Cohen, H.
// Kaplan. Summarizing data using bottom-k sketches. PODC 2007.) Where the bake knows how the level
// decays, late reflections' priorities are higher by a factor f, and tau / f stands for tau
// (late_boost.h).
//
// The choice is exact: a threshold guessed from the last sample tells the pool what to leave out,
// and is lowered until k + 1 sources reach it. What it leaves out it leaves out by bounds that hold
// for the loudest moment of every signal. Where sources are not here yet, those that are stand
// for them: with kappa the highest key P / u of what is missing near source i, P its power over all
// bands, i is chosen only if u_i < P_i / kappa, so its factor is max(1, tau / w_i, kappa / P_i):
// still unbiased, only coarser.
//
// What stands in the way (visibility_cache.h) makes weights smaller, never larger, so sources are
// found as if nothing did; those that would be chosen are looked at, best first, until k + 1 that
// were looked at are ahead of all others: the top k of all sources as they are known, though few
// were asked for.
//
// Where nearly everything is occluded, the search for k + 1 sources would go down to the weakest
// one, in every keyframe. It ends earlier, at a threshold t that fewer than k audible sources
// reach. These are published with t in the place of tau: as an audible source reaches t with
// probability min(1, w_i / t), whatever that is, the sum stays unbiased in power; only its variance
// is that of fewer voices. Silence is published where every source that reaches t is known to be
// occluded. Where the search ends depends on how it is bounded:
//
//   kBounded    real time. A keyframe has a budget of work (work_budget.h), which most keyframes
//               need a tenth of. When a lower threshold is likely to exceed it, the last threshold
//               whose look-up was completed is taken, and the next keyframe goes on from there.
//               If no look-up was completed, as when a listener leaps from silence into a crowd,
//               what was found so far is published, too quiet for that keyframe.
//   kUnbounded  a render. Every source that may be chosen was looked at from within its present
//               cell, and t is low enough that 100 000 sources and more would reach it if nothing
//               were occluded: levels with fewer are searched to the last source.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/propagation/reception.h"
#include "runtime/query/source_pool.h"

namespace clamor {

struct SampledSource {
  std::uint64_t number = 0;
  double power_scale = 1;
  const Source* source = nullptr;  // valid until the next call of sample()
  std::uint32_t signal = 0;
  Bands visibility = same_in_all_bands(1);  // share of the power that gets past what is in the way
  // That of k below which it would not be chosen: 0 the last to go, 1 the next; below 0 not known.
  double rank = -1;
  bool moves = false;
  Vec3f velocity_mps{};  // where sound left it, if it does

  // Is one that moves, and heard under another number than it is looked at.
  void set_moving(const FoundSource& found) {
    number = found.voice;
    moves = true;
    velocity_mps = found.velocity_mps;
  }
};

class MovingSourceList;

class Sampler {
 public:
  virtual ~Sampler() = default;

  // The sample for a head centred at `place`, `time_s` after everything began to play, by ascending
  // number; valid until the next call.
  virtual std::span<const SampledSource> sample(const Vec3& place, double time_s = 0) = 0;

  // What the receivers hear of each direction, from the next sample on; until then, all of it. For
  // strategies that weigh sources.
  void face(const Reception& reception) { reception_ = reception; }

  // Whether the last sample had all the sources it needed; if not, waits until more are here.
  virtual bool complete() = 0;

  // Most sources that a sample can have.
  virtual std::size_t capacity() const = 0;

  // Ends a sample early, with whatever it has, once `*stop` is set: nobody will hear it.
  virtual void stop_when(const std::atomic<bool>* /*stop*/) {}

  // Units of work (work_budget.h) that its look-ups took so far.
  virtual std::uint64_t work() const { return 0; }

  // Keyframes so far whose search was ended by the budget of work.
  virtual std::uint64_t bounded_keyframes() const { return 0; }

  // How many sources to choose from now on, at most what it was made for. Some strategies cannot.
  virtual void set_voice_count(std::size_t /*voices*/) {}

 protected:
  const Reception& reception() const { return reception_; }

 private:
  Reception reception_;
};

enum class SearchBound { kBounded, kUnbounded };

// The budget of a bounded keyframe that chooses so many sources, in units of work_budget.h. One of
// 2000 out of a million takes some 6 ms if it is spent, and another 1 ms to plan ahead.
constexpr std::uint64_t work_per_keyframe(std::size_t voices) { return 800'000 + 200 * voices; }
constexpr std::uint64_t work_ahead_per_keyframe(std::size_t voices) {
  return 100'000 + 10 * voices;
}

// All must outlive the sampler. Without `occlusion` no source is occluded.
std::unique_ptr<Sampler> make_priority_sampler(const RadiationModel& field, SignalWeights weights,
                                               SourcePool& pool, std::size_t voices,
                                               VisibilityCache* occlusion = nullptr,
                                               SearchBound bound = SearchBound::kUnbounded);
std::unique_ptr<Sampler> make_all_sampler(const RadiationModel& field, const SourceList& list,
                                          VisibilityCache* occlusion = nullptr,
                                          MovingSourceList* moving = nullptr);

}  // namespace clamor
