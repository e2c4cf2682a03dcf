#include "runtime/query/node_bounds.h"

#include <algorithm>

#include "runtime/query/query_constants.h"

namespace clamor {

using namespace query;

SignalWeights max_over_instances(const SignalWeights& weights,
                                 std::span<const std::vector<std::uint32_t>> signal_maps) {
  SignalWeights highest = weights;
  // Instances within instances play what one map after another gives.
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& map : signal_maps)
      for (std::size_t signal = 0; signal < map.size(); ++signal)
        for (std::size_t b = 0; b < kBandCount; ++b) {
          float& here = highest.by_signal[signal][b];
          const float there = highest.by_signal[map[signal]][b];
          changed = changed || there > here;
          here = std::max(here, there);
        }
  }
  return highest;
}

NodeBounds::NodeBounds(const RadiationModel& field, const SignalWeights& weights,
                       std::span<const PageEntry> trees,
                       std::span<const std::vector<std::uint32_t>> signal_maps)
    : field_(field),
      weights_(weights),
      trees_(trees),
      signal_maps_(signal_maps),
      max_weights_(weights.by_signal),
      priority_bound_(field, weights.by_signal) {}

// The window covers every place where a shortlist that is made in it can hold: its centre is up to
// one radius from here, plus one radius of the shortlist ahead of the listener, plus its own.
void NodeBounds::begin(const Vec3& place, double time_s) {
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
      top.max_delay_s + max_distance_m / field_.speed_of_sound_mps() + kDelayWindowMargin_s;
  std::vector<Bands> highest;
  max_share_ = 0;
  for (const LoudnessTrack& track : weights_.tracks) {
    const Bands& bands = highest.emplace_back(
        track.max_between(time_s - max_delay_s - field_.latest_start_s(),
                          until_s_ + kPageLookAhead_s - field_.earliest_start_s()));
    for (std::size_t b = 0; b < kBandCount; ++b)
      if (track.max()[b] > 0) max_share_ = std::max<double>(max_share_, bands[b] / track.max()[b]);
  }
  max_share_ = std::max(max_share_ * (1 + kThresholdSlack), 1e-9);
  if (highest == max_weights_) return;
  max_weights_ = std::move(highest);
  SignalWeights weights;
  weights.by_signal = max_weights_;
  priority_bound_ = PriorityBound(field_, max_over_instances(weights, signal_maps_).by_signal);
}

}  // namespace clamor
