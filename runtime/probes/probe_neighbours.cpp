#include "runtime/probes/probe_neighbours.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <nanoflann.hpp>

#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

namespace {

constexpr double kSoftening_m = 0.25;  // e
constexpr float kSightRate = 0.2f;     // of the way to the last test, per keyframe
constexpr float kSightSettled = 0.01f;
constexpr std::int64_t kRaysPerKeyframe = 4000;
// A line of sight holds within this share of the distance to the nearest probe, and these limits.
constexpr double kValidPerDistance = 0.1;
constexpr float kLeastValid_m = 0.05f, kMostValid_m = 0.5f;
constexpr std::size_t kWideSearch = 64;  // probes, where none of the nearest is seen

double weight_at(double distance2_m2) {
  const double softened = distance2_m2 + kSoftening_m * kSoftening_m;
  return 1 / (softened * softened);
}

// Adaptor of the probes for nanoflann.
struct Points {
  const std::vector<Vec3>& places_m;

  std::size_t kdtree_get_point_count() const { return places_m.size(); }
  double kdtree_get_pt(std::size_t index, std::size_t axis) const {
    return places_m[index][static_cast<int>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

}  // namespace

struct ProbeNeighbours::Tree {
  explicit Tree(const std::vector<Vec3>& places_m) : points{places_m} { index.buildIndex(); }

  // Indices of the nearest probes, nearest first. Returns how many there are.
  std::size_t nearest(const Vec3& place_m, std::span<std::uint32_t> probes) {
    std::array<double, kWideSearch> distance2{};
    nanoflann::KNNResultSet<double, std::uint32_t> result(probes.size());
    result.init(probes.data(), distance2.data());
    index.findNeighbors(result, &place_m.x, {});
    return result.size();
  }

  Points points;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>, Points, 3,
                                      std::uint32_t>
      index{3, points, nanoflann::KDTreeSingleIndexAdaptorParams(8)};
};

ProbeNeighbours::ProbeNeighbours(std::vector<Vec3> probes_m, const OcclusionGeometry* surfaces,
                                 std::size_t sources)
    : probes_m_(std::move(probes_m)),
      surfaces_(surfaces),
      tree_(std::make_unique<Tree>(probes_m_)),
      states_(sources) {}

ProbeNeighbours::~ProbeNeighbours() = default;

void ProbeNeighbours::begin() {
  rays_left_ = kRaysPerKeyframe;
  is_settled_ = true;
  unseen_ = 0;
}

// Replaces the candidates by the nearest probes; those that stay keep what is known of them.
void ProbeNeighbours::find_candidates(State& state, const Vec3& place_m) {
  const State before = state;
  std::array<std::uint32_t, kWideSearch> nearest{};
  state.count =
      static_cast<std::uint32_t>(tree_->nearest(place_m, std::span(nearest).first(kCandidates)));
  for (std::size_t c = 0; c < state.count; ++c) {
    state.probe[c] = nearest[c];
    const auto end = before.probe.begin() + before.count;
    const auto known = std::find(before.probe.begin(), end, nearest[c]);
    state.seen[c] =
        known == end ? 0 : before.seen[static_cast<std::size_t>(known - before.probe.begin())];
  }
}

void ProbeNeighbours::test(State& state, const Vec3& place_m) {
  find_candidates(state, place_m);
  const auto sees = [&](std::uint32_t probe) {
    --rays_left_;
    return surfaces_ == nullptr || surfaces_->is_free(Vec3f(place_m), Vec3f(probes_m_[probe]));
  };
  bool any = false;
  for (std::size_t c = 0; c < state.count; ++c) {
    state.seen_now[c] = sees(state.probe[c]) ? 1 : 0;
    any |= state.seen_now[c] > 0;
  }
  if (!any && probes_m_.size() > kCandidates) {
    // Behind a thin wall the nearest probes may all be in the other room.
    std::array<std::uint32_t, kWideSearch> nearest{};
    const std::size_t count = tree_->nearest(place_m, nearest);
    std::size_t found = 0;
    for (std::size_t n = kCandidates; n < count && found < kCandidates; ++n) {
      if (!sees(nearest[n])) continue;
      state.probe[found] = nearest[n];
      state.seen[found] = state.is_new ? 0 : state.seen[found];
      state.seen_now[found++] = 1;
    }
    if (found > 0) state.count = static_cast<std::uint32_t>(found);
  }
  const double nearest_m = state.count > 0 ? length(place_m - probes_m_[state.probe[0]]) : 0;
  state.tested_m = Vec3f(place_m);
  state.valid_m =
      std::clamp(static_cast<float>(kValidPerDistance * nearest_m), kLeastValid_m, kMostValid_m);
}

std::span<const ProbeWeight> ProbeNeighbours::weights(std::size_t source, std::uint32_t generation,
                                                      const Vec3& place_m) {
  State& state = states_[source];
  if (state.generation != generation) {
    state = {};
    state.generation = generation;
  }
  const bool is_near = length(place_m - Vec3(state.tested_m)) <= static_cast<double>(state.valid_m);
  if (state.is_new || (!is_near && rays_left_ > 0)) test(state, place_m);
  for (std::size_t c = 0; c < state.count; ++c) {
    const float change = state.seen_now[c] - state.seen[c];
    if (state.is_new || std::abs(change) < kSightSettled)
      state.seen[c] = state.seen_now[c];
    else
      state.seen[c] += kSightRate * change;
    is_settled_ &= state.seen[c] == state.seen_now[c];
  }
  state.is_new = false;

  // The largest weights, in order.
  std::array<ProbeWeight, kCandidates> all;
  for (std::size_t c = 0; c < state.count; ++c) {
    const Vec3 away_m = place_m - probes_m_[state.probe[c]];
    all[c] = {state.probe[c], state.seen[c] * static_cast<float>(weight_at(dot(away_m, away_m)))};
  }
  const std::size_t kept = std::min<std::size_t>(state.count, weights_.size());
  std::partial_sort(all.begin(), all.begin() + kept, all.begin() + state.count,
                    [](const ProbeWeight& a, const ProbeWeight& b) {
                      return a.weight != b.weight ? a.weight > b.weight : a.probe < b.probe;
                    });
  std::copy_n(all.begin(), kept, weights_.begin());
  const float fifth = kept > kMaxCopies ? weights_[kMaxCopies].weight : 0;
  float sum = 0;
  std::size_t count = 0;
  for (; count < std::min(kept, kMaxCopies) && weights_[count].weight > fifth; ++count) {
    weights_[count].weight -= fifth;
    sum += weights_[count].weight;
  }
  if (!(sum > 0)) {
    ++unseen_;
    return {};
  }
  for (std::size_t c = 0; c < count; ++c) weights_[c].weight /= sum;
  return std::span(weights_).first(count);
}

}  // namespace clamor
