#include "runtime/field/source_weight.h"

namespace clamor {

double weight(const SourceField& field, const Bands& of_signal, const Source& source,
              const Vec3& place, const Reception& reception) {
  return weighed_sum(of_signal, faced(reception, source, place, field.intensity(source, place)));
}

LoudnessTrack::Moment weights_now(const SourceField& field, const SignalWeights& weights,
                                  std::uint32_t signal, const Source& source, const Vec3& place,
                                  double time_s) {
  return weights_heard(field, weights, signal, source, length(place - Vec3(source.position_m)),
                       time_s);
}

}  // namespace clamor
