#include "runtime/field/source_weight.h"

namespace clamor {

double weighed_sum(const Bands& weights, const Bands& intensity) {
  double sum = 0;
  for (std::size_t b = 0; b < kBandCount; ++b)
    sum += static_cast<double>(weights[b]) * intensity[b];
  return sum;
}

Bands faced(const Reception& reception, const Source& source, const Vec3& place,
            const Bands& intensity) {
  if (reception.is_even()) return intensity;
  return weighed(reception.share(Vec3f(Vec3(source.position_m) - place)), intensity);
}

double weight(const SourceField& field, const Bands& of_signal, const Source& source,
              const Vec3& place, const Reception& reception) {
  return weighed_sum(of_signal, faced(reception, source, place, field.intensity(source, place)));
}

LoudnessTrack::Moment weights_heard(const SourceField& field, const SignalWeights& weights,
                                    std::uint32_t signal, const Source& source, double way_m,
                                    double time_s) {
  if (weights.steady()) return {weights.by_signal[signal], 1};
  return weights.tracks[signal].at(time_s - field.delay_s(source, way_m));
}

LoudnessTrack::Moment weights_now(const SourceField& field, const SignalWeights& weights,
                                  std::uint32_t signal, const Source& source, const Vec3& place,
                                  double time_s) {
  return weights_heard(field, weights, signal, source, length(place - Vec3(source.position_m)),
                       time_s);
}

}  // namespace clamor
