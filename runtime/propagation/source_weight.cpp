#include "runtime/propagation/source_weight.h"

namespace clamor {

double weight(const RadiationModel& radiation, const Bands& signal_weights, const Source& source,
              const Vec3& place, const Reception& reception) {
  return weighted_sum(signal_weights, apply_reception(reception, source, place,
                                                      radiation.intensity(source, place)));
}

LoudnessTrack::Moment weights_at_place(const RadiationModel& radiation,
                                       const SignalWeights& weights, std::uint32_t signal,
                                       const Source& source, const Vec3& place, double time_s) {
  return weights_at_distance(radiation, weights, signal, source,
                             length(place - Vec3(source.position_m)), time_s);
}

}  // namespace clamor
