// sampler.h: which sources are heard by a listener, each with the factor that scales its power.
//
// A source's weight estimates its audibility: w_i = sum_b loudness_b x signal_b x I_ib x e_ib, with
// loudness_b from BS.1770 (loudness.h), signal_b the mean square of its signal in the band around
// the moment that is heard (signal_weights.h), I_ib its intensity at the listener
// (radiation_model.h), and e_ib the receivers' sensitivity towards it (reception.h).
//
// The sampler "all" takes every source. The sampler "priority" takes the k sources of highest
// priority w_i / u_i, with a permanent uniform u_i per source, and scales their power by
// max(1, tau / w_i), with tau the (k+1)-th priority. The estimate is unbiased in power, and the
// sample changes only as far as weights do. (N. Duffield, C. Lund, M. Thorup. Priority sampling for
// estimation of arbitrary subset sums. J. ACM 54(6), 2007. E. Cohen, H. Kaplan. Summarizing data
// using bottom-k sketches. PODC 2007.) Sources that are silent now, or whose sounds are not in
// memory (sound_loader.h), are not chosen. The late boost, missing pages and occlusion change the
// factor; runtime/README.md, "Sampling", says how.
//
// Two modes end a search that finds nearly all sources occluded:
//
//   kBounded    real time. A keyframe has a budget of work (work_budget.h), and the next one
//               continues from the last threshold with a completed query. If none was completed,
//               the sources found so far are published, which is too quiet for that keyframe.
//   kUnbounded  offline render. Every source that may be chosen has a valid visibility estimate,
//               and the threshold falls until 100 000 sources would reach it without occlusion.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/bands.h"
#include "common/listener.h"
#include "common/vec.h"
#include "runtime/propagation/reception.h"
#include "runtime/query/source_pool.h"
#include "runtime/query/work_budget.h"
#include "runtime/sampling/gain_factors.h"
#include "runtime/streaming/wanted_sound.h"

namespace clamor {

struct SampledSource {
  std::uint64_t number = 0;
  double power_scale = 1;
  const Source* source = nullptr;  // valid until the next call of sample()
  std::uint32_t signal = 0;
  GainFactors factors{};
  // Fraction of k below which the source would not be chosen: 0 is dropped last, 1 is dropped next.
  // Below 0 if unknown.
  double rank = -1;
  bool moves = false;    // a moving source, or one that is heard around edges
  Vec3f velocity_mps{};  // of a moving source, when the sound left it
  double start_s = 0;    // of a moving source's sound, on top of the source's delay
  double weight = 0;     // as it is heard, with scale and occlusion; 0 if unknown

  // Makes this a moving source, whose voice id differs from the key of its cached visibility.
  void set_moving(const FoundSource& found) {
    number = found.voice;
    moves = true;
    velocity_mps = found.velocity_mps;
    start_s = found.start_s;
  }
};

class MovingSourceList;
class SoundLoader;
class VisibilityCache;

class Sampler {
 public:
  virtual ~Sampler() = default;

  // The sample for a listener, `time_s` after everything began to play, by ascending number. Valid
  // until the next call. Samplers use the listener's position and velocity; the orientation enters
  // through set_reception().
  virtual std::span<const SampledSource> sample(const Listener& listener, double time_s = 0) = 0;

  // Renews the occlusion of some sources of the last sample, ascending by number, for a listener
  // who has moved since. The sample stays where it is.
  virtual void renew(std::span<const std::uint64_t> /*numbers*/, const Listener& /*listener*/) {}

  // Whether a sample of now would differ from the last one for no other reason than that the
  // listener has moved and time has passed.
  virtual bool is_settled() const { return false; }

  // Sets the receivers' directivity from the next sample on, for samplers that weigh sources. The
  // initial one is omnidirectional.
  void set_reception(const Reception& reception) { reception_ = reception; }

  // Whether the last sample had all the sources it needed; if not, waits until more are loaded.
  virtual bool complete() = 0;

  // Largest possible number of sources in a sample.
  virtual std::size_t capacity() const = 0;

  // Ends a sample early, with what was found so far, once `*stop` is set.
  virtual void stop_when(const std::atomic<bool>* /*stop*/) {}

  // Units of work (work_budget.h) spent on queries so far.
  virtual std::uint64_t work() const { return 0; }

  // Number of keyframes so far whose search was ended by the budget of work.
  virtual std::uint64_t bounded_keyframes() const { return 0; }

  // Sets the sample size, at most capacity(). Some strategies ignore it.
  virtual void set_voice_count(std::size_t /*voices*/) {}

  // Takes only sources whose sounds the loader has ready, from the next sample on; null: all. The
  // loader must outlive the sampler. Some strategies ignore it.
  virtual void set_sounds(const SoundLoader* /*sounds*/) {}

  // The sounds of sources that the last sample left out because they are not in memory.
  virtual std::span<const WantedSound> unheard() const { return {}; }

  // Scales the power of all sources of an emitter, by its index, from the next sample on: 0 to 1;
  // emitters beyond the end of the list keep theirs. Some strategies ignore it.
  virtual void set_emitter_powers(std::vector<float> /*powers*/) {}

 protected:
  const Reception& reception() const { return reception_; }

 private:
  Reception reception_;
};

// Budget of a bounded keyframe for samples of this size, in units of work_budget.h. A keyframe that
// samples 2000 of a million sources and spends all of it takes about 6 ms, and 1 ms for planning
// ahead.
constexpr std::uint64_t work_per_keyframe(std::size_t voices) { return 800'000 + 200 * voices; }
constexpr std::uint64_t work_ahead_per_keyframe(std::size_t voices) {
  return 100'000 + 10 * voices;
}

// All arguments must outlive the sampler. Without `occlusion` no source is occluded.
std::unique_ptr<Sampler> make_priority_sampler(const RadiationModel& radiation,
                                               SignalWeights weights, SourcePool& pool,
                                               std::size_t voices,
                                               VisibilityCache* occlusion = nullptr,
                                               SearchBound bound = SearchBound::kUnbounded);

}  // namespace clamor
