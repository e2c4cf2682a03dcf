// source_weight.h: a source's weight at a place, the w_i of sampler.h.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/reception.h"
#include "runtime/propagation/signal_weights.h"

namespace clamor {

// Multiplies band by band.
inline Bands weighted(const Bands& weights, Bands intensity) {
  for (std::size_t b = 0; b < kBandCount; ++b) intensity[b] *= weights[b];
  return intensity;
}
inline double weighted_sum(const Bands& weights, const Bands& intensity) {
  double sum = 0;
  for (std::size_t b = 0; b < kBandCount; ++b)
    sum += static_cast<double>(weights[b]) * intensity[b];
  return sum;
}

// A source's intensity at `place` as received by directional receivers.
inline Bands apply_reception(const Reception& reception, const Source& source, const Vec3& place,
                             const Bands& intensity) {
  if (reception.is_omnidirectional()) return intensity;
  return weighted(reception.share(Vec3f(Vec3(source.position_m) - place)), intensity);
}

// Weight of a source whose signal has these weights.
double weight(const RadiationModel& radiation, const Bands& signal_weights, const Source& source,
              const Vec3& place, const Reception& reception = Reception());

// Weights of a signal as received at a time from a source at a distance.
inline LoudnessTrack::Moment weights_at_distance(const RadiationModel& radiation,
                                                 const SignalWeights& weights, std::uint32_t signal,
                                                 const Source& source, double distance_m,
                                                 double time_s) {
  if (weights.steady() && signal < weights.by_signal.size()) return {weights.by_signal[signal], 1};
  return weights.at(signal, time_s - radiation.delay_s(source, distance_m));
}

// Weights of a signal as received at a time and place.
LoudnessTrack::Moment weights_at_place(const RadiationModel& radiation,
                                       const SignalWeights& weights, std::uint32_t signal,
                                       const Source& source, const Vec3& place, double time_s);

}  // namespace clamor
