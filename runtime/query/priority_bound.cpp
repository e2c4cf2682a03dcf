#include "runtime/query/priority_bound.h"

#include <cmath>

#include "runtime/propagation/received_intensity.h"

namespace clamor {

namespace {

constexpr double kSlack = 1.0001;  // single precision of keys, bounds and distances
constexpr double kGive_m = 0.002;  // quantised positions, 10 km from the origin

// Does the cone point away from wherever in the ball one looks from? With c the cone's half angle
// and b the ball's as it is seen from the place, the way there must be more than c + b off the
// axis, and cos (c + b) = cos c cos b - sin c sin b.
bool points_away(const NodeSummary& node, const Vec3& way, double radius_m) {
  const double way_m = length(way);
  if (way_m <= radius_m) return false;
  const double cos_c = node.cone_cos, sin_c = std::sqrt(std::max(0.0, 1 - cos_c * cos_c));
  const double sin_b = radius_m / way_m, cos_b = std::sqrt(1 - sin_b * sin_b);
  if (cos_c <= 1e-3 - cos_b) return false;  // c + b is all there is
  constexpr double kGive = 1e-3;            // radians, and cosines change no faster
  return dot(way, Vec3(node.cone_axis)) < (cos_c * cos_b - sin_c * sin_b - kGive) * way_m;
}

}  // namespace

PriorityBound::PriorityBound(const RadiationModel& field, std::span<const Bands> weights) {
  const Bands most = field.max_weight_per_power(weights);
  const Bands& loss_per_m = field.air_loss_per_m();
  for (std::size_t i = 0; i < most_.size(); ++i) {
    const auto nearest_m = std::bit_cast<float>((kFirst + static_cast<std::uint32_t>(i)) << 20) *
                           (i > 0 ? 1.0f : 0.0f);
    for (std::size_t b = 0; b < kBandCount; ++b)
      most_[i] = std::max(most_[i], kSlack * static_cast<double>(most[b]) *
                                        std::exp(-static_cast<double>(loss_per_m[b]) *
                                                 static_cast<double>(nearest_m)));
  }
}

double PriorityBound::per_key(const NodeSummary& node, const Vec3& place, double to_level,
                              double give_m) const {
  const Vec3 low(node.low_m), high(node.high_m);
  const Vec3 away = glm::max(glm::max(low - place, place - high), Vec3(0));
  const double near_m = std::max(length(away) - kGive_m - give_m, kEmitterRadius_m);
  if (node.cone_cos > -1 &&
      points_away(node, place - (low + high) / 2.0, length(high - low) / 2 + kGive_m + give_m))
    return 0;
  return most_at(near_m * to_level) / (near_m * near_m);
}

}  // namespace clamor
