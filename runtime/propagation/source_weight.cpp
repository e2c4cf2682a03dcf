#include "runtime/propagation/source_weight.h"

namespace clamor {

double weight(const RadiationModel& field, const Bands& signal_weights, const Source& source,
              const Vec3& place, const Reception& reception) {
  return weighted_sum(signal_weights,
                      apply_reception(reception, source, place, field.intensity(source, place)));
}

LoudnessTrack::Moment weights_at_place(const RadiationModel& field, const SignalWeights& weights,
                                       std::uint32_t signal, const Source& source,
                                       const Vec3& place, double time_s) {
  return weights_at_distance(field, weights, signal, source,
                             length(place - Vec3(source.position_m)), time_s);
}

}  // namespace clamor
