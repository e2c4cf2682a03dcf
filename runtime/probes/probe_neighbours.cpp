#include "runtime/probes/probe_neighbours.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <nanoflann.hpp>

#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/propagation/tolerances.h"

namespace clamor {

namespace {

using namespace probe_choice;

bool is_before(const ProbeWeight& a, const ProbeWeight& b) {
  return a.weight != b.weight ? a.weight > b.weight : a.probe < b.probe;
}

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
  rays_left_ = kProbeRaysPerKeyframe;
  is_settled_ = true;
  unseen_ = 0;
  ++keyframe_;
  if (surfaces_ != nullptr) parts_version_ = surfaces_->parts_version();
}

// Finds the nearest probes, and which of them the source sees.
void ProbeNeighbours::test(State& state, const Vec3& place_m) {
  std::array<std::uint32_t, kWideSearch> nearest{};
  state.count =
      static_cast<std::uint32_t>(tree_->nearest(place_m, std::span(nearest).first(kCandidates)));
  const auto sees = [&](std::uint32_t probe) {
    --rays_left_;
    return surfaces_ == nullptr || surfaces_->is_free(Vec3f(place_m), Vec3f(probes_m_[probe]));
  };
  bool any = false;
  for (std::size_t c = 0; c < state.count; ++c) {
    state.probe[c] = nearest[c];
    state.is_seen[c] = sees(nearest[c]);
    any |= state.is_seen[c];
  }
  const double nearest_m = state.count > 0 ? length(place_m - probes_m_[nearest[0]]) : 0;
  state.tested_m = Vec3f(place_m);
  state.parts_version = parts_version_;
  state.tested_in = keyframe_;
  state.valid_m =
      std::clamp(static_cast<float>(kValidPerDistance * nearest_m), kLeastValid_m, kMostValid_m);
  if (any || probes_m_.size() <= kCandidates) return;
  // Behind a thin wall the nearest probes may all be in the other room.
  const std::size_t count = tree_->nearest(place_m, nearest);
  std::size_t found = 0;
  for (std::size_t n = kCandidates; n < count && found < kCandidates; ++n) {
    if (!sees(nearest[n])) continue;
    state.probe[found] = nearest[n];
    state.is_seen[found++] = true;
  }
  if (found > 0) state.count = static_cast<std::uint32_t>(found);
}

// The weights at a place.
ProbeNeighbours::Weights ProbeNeighbours::wanted(const State& state, const Vec3& place_m) const {
  std::array<ProbeWeight, kCandidates> seen;
  std::size_t count = 0;
  for (std::size_t c = 0; c < state.count; ++c) {
    if (!state.is_seen[c]) continue;
    const Vec3 away_m = place_m - probes_m_[state.probe[c]];
    seen[count++] = {state.probe[c], static_cast<float>(weight_at(dot(away_m, away_m)))};
  }
  std::partial_sort(seen.begin(), seen.begin() + std::min(count, kNearest + 1),
                    seen.begin() + count, is_before);
  const float fifth = count > kNearest ? seen[kNearest].weight : 0;
  Weights weights;
  for (std::size_t c = 0; c < std::min(count, kNearest) && seen[c].weight > fifth; ++c)
    weights.of[weights.count++] = {seen[c].probe, seen[c].weight - fifth};
  weights.scale_to_one();
  return weights;
}

void ProbeNeighbours::Weights::scale_to_one() {
  float sum = 0;
  for (const ProbeWeight& one : all()) sum += one.weight;
  if (!(sum > 0)) count = 0;
  for (std::uint32_t c = 0; c < count; ++c) of[c].weight /= sum;
}

// Takes the weights a part of the way to those that are wanted. Returns whether they are there.
bool ProbeNeighbours::follow(Weights& now, const Weights& wanted) {
  std::array<ProbeWeight, kMaxCopies + kNearest> next;
  std::array<float, kMaxCopies + kNearest> targets{};
  std::copy_n(now.of.begin(), now.count, next.begin());
  std::size_t count = now.count;
  for (const ProbeWeight& one : wanted.all()) {
    std::size_t c = 0;
    while (c < count && next[c].probe != one.probe) ++c;
    if (c == count) next[count++] = {one.probe, 0};
    targets[c] = one.weight;
  }
  bool is_there = true;
  std::size_t kept = 0;
  for (std::size_t c = 0; c < count; ++c) {
    const float change = targets[c] - next[c].weight;
    is_there &= std::abs(change) < kLeastWeight;
    const float weight = next[c].weight + kRate * change;
    if (targets[c] > 0 || weight > kLeastWeight) next[kept++] = {next[c].probe, weight};
  }
  if (is_there) {
    now = wanted;
    return true;
  }
  now.count = static_cast<std::uint32_t>(std::min(kept, kMaxCopies));
  std::partial_sort(next.begin(), next.begin() + now.count, next.begin() + kept, is_before);
  std::copy_n(next.begin(), now.count, now.of.begin());
  now.scale_to_one();
  return false;
}

// Tests the lines of sight again where they may have changed. What has to wait is not settled.
void ProbeNeighbours::renew(State& state, const Vec3& place_m) {
  const bool is_near = length(place_m - Vec3(state.tested_m)) <= static_cast<double>(state.valid_m);
  if (!state.is_new && is_near && state.parts_version == parts_version_) return;
  const bool has_turn = !is_near || keyframe_ >= state.tested_in + kPartsTestedEvery;
  if (state.is_new || (has_turn && rays_left_ > 0))
    test(state, place_m);
  else
    is_settled_ = false;
}

std::span<const ProbeWeight> ProbeNeighbours::weights(std::size_t source, std::uint32_t generation,
                                                      const Vec3& place_m) {
  State& state = states_[source];
  if (state.generation != generation) {
    state = {};
    state.generation = generation;
  }
  if (!(length(place_m - Vec3(state.last_m)) < kLeap_m)) state.now.count = 0;
  state.last_m = Vec3f(place_m);
  renew(state, place_m);
  state.is_new = false;
  const Weights wanted = this->wanted(state, place_m);
  if (wanted.count == 0) {
    if (state.now.count > 0 && ++state.blind_keyframes > kBlindKeyframes) state.now.count = 0;
    is_settled_ &= state.now.count == 0;
  } else {
    state.blind_keyframes = 0;
    if (state.now.count == 0)
      state.now = wanted;
    else
      is_settled_ &= follow(state.now, wanted);
  }
  if (state.now.count == 0) ++unseen_;
  return state.now.all();
}

}  // namespace clamor
