// sampler.h: which sources are heard at a place, each with the factor its power is scaled by.
//
// The weight of a source is what the ear would miss: w_i = sum_b loudness_b x signal_b x I_ib, with
// loudness_b from BS.1770 (loudness.h), signal_b the mean square of its signal in the band, and
// I_ib its intensity at the place (source_field.h).
//
// "all" takes every source as it is. "priority" takes the k of highest priority w_i / u_i, u_i
// being permanent, and scales their power by max(1, tau / w_i), tau the (k+1)-th priority: unbiased
// in power, and the choice changes only as far as the weights do. (N. Duffield, C. Lund, M. Thorup.
// Priority sampling for estimation of arbitrary subset sums. J. ACM 54(6), 2007. E. Cohen, H.
// Kaplan. Summarizing data using bottom-k sketches. PODC 2007.)
//
// The scan is flat but exact and quick: a bound of each priority, one division from a packed array,
// is held against a threshold guessed from the last sample, and only sources above it are weighed.
// 300 000 wall sources, k = 2000, listener walking: see the benchmark.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/vec.h"
#include "runtime/source_field.h"

namespace clamor {

struct SampledSource {
  std::uint32_t source = 0;
  double power_scale = 1;
};

class Sampler {
 public:
  virtual ~Sampler() = default;

  // The sample for a head centred at `place`, by ascending source number; valid until the next
  // call.
  virtual std::span<const SampledSource> sample(const Vec3& place) = 0;

  // Most sources that a sample can have.
  virtual std::size_t capacity() const = 0;
};

// Loudness times mean square of each signal, per band: what an intensity is weighed with.
struct SignalWeights {
  std::vector<Bands> by_signal;
};

double weight(const SourceField& field, const SignalWeights& weights, std::size_t source,
              const Vec3& place);

// `strategy` is "all" or "priority"; anything else gives null. `u` has a number per source.
// `field` must outlive the sampler.
std::unique_ptr<Sampler> make_sampler(const std::string& strategy, const SourceField& field,
                                      SignalWeights weights, std::span<const float> u,
                                      std::size_t voices);

}  // namespace clamor
