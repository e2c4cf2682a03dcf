#include "runtime/occlusion/fresnel_visibility.h"

#include <cmath>
#include <iterator>

#include "runtime/occlusion/place_order.h"
#include "runtime/occlusion/zone_estimator.h"

namespace clamor {

LineOfSight either_way(const LineOfSight& line) {
  const Vec3f &a = line.from_m, &b = line.to_m;
  return comes_before(b, a) ? LineOfSight{b, a, line.speed_of_sound_mps} : line;
}

float diffracted_amplitude(float free_fraction) {
  constexpr float kFraction[] = {0, 0.01f, 0.06f, 0.275f, 0.375f, 0.5f, 0.74f};
  constexpr float kAmplitude[] = {0, 0.15f, 0.185f, 0.295f, 0.39f, 0.59f, 1};
  for (std::size_t i = 1; i < std::size(kFraction); ++i)
    if (free_fraction < kFraction[i])
      return kAmplitude[i - 1] + (kAmplitude[i] - kAmplitude[i - 1]) *
                                     (free_fraction - kFraction[i - 1]) /
                                     (kFraction[i] - kFraction[i - 1]);
  return 1;
}

double wavelength_m(std::size_t band, double speed_of_sound_mps) {
  return speed_of_sound_mps / (1000 * std::exp2(static_cast<double>(band) - 4));
}

Bands fresnel_visibility(const OcclusionGeometry& geometry, const LineOfSight& line,
                         int paths_per_ring, std::uint64_t& rays, bool* line_is_free) {
  if (line_is_free != nullptr) *line_is_free = true;
  if (geometry.empty()) return same_in_all_bands(1);
  LineState state(line);
  LineState* const lines[] = {&state};
  ZoneEstimator<1> estimator(geometry, lines);
  estimator.test_straight_lines();
  estimator.estimate(paths_per_ring);
  rays += state.estimate.rays;
  if (line_is_free != nullptr) *line_is_free = state.estimate.line_is_free;
  return state.estimate.diffracted;
}

}  // namespace clamor
