#include "runtime/query/node_bounds.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "runtime/propagation/received_intensity.h"
#include "runtime/propagation/tolerances.h"

namespace clamor {

using namespace query;

namespace {

// The table of distances has an entry for all floats of equal exponent and three leading bits of
// mantissa; its first is that of 1/16 m.
constexpr std::uint32_t kFirstEntry = (127 - 4) << 3;
std::uint32_t entry_of(float distance_m) { return std::bit_cast<std::uint32_t>(distance_m) >> 20; }

// Does the emission cone point away from the listener, wherever in the ball the sources are? With c
// the half angle of the cone and b that of the ball as the listener sees it, the direction to the
// listener must be more than c + b off the axis: cos (c + b) = cos c cos b - sin c sin b.
bool points_away(const NodeSummary& node, const Vec3& to_listener, double radius_m) {
  const double distance_m = length(to_listener);
  if (distance_m <= radius_m) return false;
  const double cos_c = node.cone_cos, sin_c = std::sqrt(std::max(0.0, 1 - cos_c * cos_c));
  const double sin_b = radius_m / distance_m, cos_b = std::sqrt(1 - sin_b * sin_b);
  if (cos_c <= kConeError - cos_b) return false;  // c + b covers all directions
  return dot(to_listener, Vec3(node.cone_axis)) <
         (cos_c * cos_b - sin_c * sin_b - kConeError) * distance_m;
}

}  // namespace

SignalWeights max_over_instances(const SignalWeights& weights,
                                 std::span<const std::vector<std::uint32_t>> signal_maps) {
  SignalWeights raised = weights;
  // Instances within instances play what one map after another gives.
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& map : signal_maps)
      for (std::size_t signal = 0; signal < map.size(); ++signal)
        for (std::size_t b = 0; b < kBandCount; ++b) {
          float& here = raised.by_signal[signal][b];
          const float there = raised.by_signal[map[signal]][b];
          changed = changed || there > here;
          here = std::max(here, there);
        }
  }
  return raised;
}

NodeBounds::NodeBounds(const RadiationModel& radiation, const SignalWeights& weights,
                       std::span<const PageEntry> trees,
                       std::span<const std::vector<std::uint32_t>> signal_maps)
    : radiation_(radiation),
      weights_(weights),
      trees_(trees),
      signal_maps_(signal_maps),
      max_weights_(weights.by_signal) {
  tabulate(max_weights_);
}

void NodeBounds::tabulate(std::span<const Bands> weights) {
  const Bands max_weight = radiation_.max_weight_per_power(weights);
  const Bands& loss_per_m = radiation_.air_loss_per_m();
  at_distance_.fill(0);
  for (std::uint32_t i = 0; i < kDistances; ++i) {
    const float nearest_m = i > 0 ? std::bit_cast<float>((kFirstEntry + i) << 20) : 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      at_distance_[i] = std::max(
          at_distance_[i],
          kNodeBoundSlack * static_cast<double>(max_weight[b]) *
              std::exp(-static_cast<double>(loss_per_m[b]) * static_cast<double>(nearest_m)));
  }
}

double NodeBounds::per_key(const NodeSummary& node, const Vec3& place, double to_level,
                           double radius_m) const {
  const Vec3 low(node.low_m), high(node.high_m);
  const double margin_m = kPositionError_m + radius_m;
  const double near_m = std::max(distance_m(node, place) - margin_m, kEmitterRadius_m);
  if (node.cone_cos > -1 &&
      points_away(node, place - (low + high) / 2.0, length(high - low) / 2 + margin_m))
    return 0;
  const std::uint32_t entry =
      std::max(entry_of(static_cast<float>(near_m * to_level)), kFirstEntry) - kFirstEntry;
  return at_distance_[std::min<std::size_t>(entry, kDistances - 1)] / (near_m * near_m);
}

// The window covers every place where a shortlist that is made in it can hold: its centre is up to
// one radius from here, plus one radius of the shortlist ahead of the listener, plus its own.
void NodeBounds::begin(const QueryKeyframe& keyframe) {
  const Vec3& place = keyframe.place_m();
  const double time_s = keyframe.time_s;
  boost_strength_ = keyframe.late_boost;
  if (weights_.steady() || trees_.empty()) {
    until_s_ = std::numeric_limits<double>::infinity();
    return;
  }
  if (time_s >= from_s_ && time_s + kMinSignalWindow_s <= until_s_ &&
      length(place - centre_) <= kMaxListRadius_m)
    return;
  centre_ = place;
  from_s_ = time_s;
  until_s_ = time_s + kSignalWindow_s;
  const PageEntry& top = trees_.back();
  const Vec3 low(top.low_m), high(top.high_m);
  const double max_distance_m = length(place - (low + high) / 2.0) + length(high - low) / 2 +
                                kPositionError_m + 3 * kMaxListRadius_m;
  const double max_delay_s =
      top.max_delay_s + max_distance_m / radiation_.speed_of_sound_mps() + kDelayWindowMargin_s;
  std::vector<Bands> max_weights;
  max_share_ = 0;
  for (const LoudnessTrack& track : weights_.tracks) {
    const Bands& bands = max_weights.emplace_back(
        track.max_between(time_s - max_delay_s - radiation_.latest_start_s(),
                          until_s_ + kPageLookAhead_s - radiation_.earliest_start_s()));
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (track.max()[b] > 0) max_share_ = std::max<double>(max_share_, bands[b] / track.max()[b]);
  }
  max_share_ = std::max(max_share_ * (1 + kThresholdSlack), 1e-9);
  if (max_weights == max_weights_) return;
  max_weights_ = std::move(max_weights);
  SignalWeights weights;
  weights.by_signal = max_weights_;
  tabulate(max_over_instances(weights, signal_maps_).by_signal);
}

}  // namespace clamor
