#include "runtime/query/priority_bound.h"

#include <cmath>

#include "runtime/propagation/received_intensity.h"
#include "runtime/query/query_constants.h"

namespace clamor {

namespace {

// Does the emission cone point away from the listener, wherever in the ball the sources are? With c
// the half angle of the cone and b that of the ball as the listener sees it, the direction to the
// listener must be more than c + b off the axis: cos (c + b) = cos c cos b - sin c sin b.
bool points_away(const NodeSummary& node, const Vec3& to_listener, double radius_m) {
  const double distance_m = length(to_listener);
  if (distance_m <= radius_m) return false;
  const double cos_c = node.cone_cos, sin_c = std::sqrt(std::max(0.0, 1 - cos_c * cos_c));
  const double sin_b = radius_m / distance_m, cos_b = std::sqrt(1 - sin_b * sin_b);
  if (cos_c <= query::kConeError - cos_b) return false;  // c + b covers all directions
  return dot(to_listener, Vec3(node.cone_axis)) <
         (cos_c * cos_b - sin_c * sin_b - query::kConeError) * distance_m;
}

}  // namespace

PriorityBound::PriorityBound(const RadiationModel& field, std::span<const Bands> weights) {
  const Bands highest = field.max_weight_per_power(weights);
  const Bands& loss_per_m = field.air_loss_per_m();
  for (std::size_t i = 0; i < at_distance_.size(); ++i) {
    const auto nearest_m = std::bit_cast<float>((kFirst + static_cast<std::uint32_t>(i)) << 20) *
                           (i > 0 ? 1.0f : 0.0f);
    for (std::size_t b = 0; b < kBandCount; ++b)
      at_distance_[i] = std::max(
          at_distance_[i],
          query::kNodeBoundSlack * static_cast<double>(highest[b]) *
              std::exp(-static_cast<double>(loss_per_m[b]) * static_cast<double>(nearest_m)));
  }
}

double PriorityBound::per_key(const NodeSummary& node, const Vec3& place, double to_level,
                              double radius_m) const {
  const Vec3 low(node.low_m), high(node.high_m);
  const Vec3 outside = glm::max(glm::max(low - place, place - high), Vec3(0));
  const double margin_m = query::kPositionError_m + radius_m;
  const double near_m =
      std::max(length(outside) - query::kPositionError_m - radius_m, kEmitterRadius_m);
  if (node.cone_cos > -1 &&
      points_away(node, place - (low + high) / 2.0, length(high - low) / 2 + margin_m))
    return 0;
  return at_distance(near_m * to_level) / (near_m * near_m);
}

}  // namespace clamor
