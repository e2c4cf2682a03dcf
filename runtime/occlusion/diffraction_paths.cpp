#include "runtime/occlusion/diffraction_paths.h"

#include <algorithm>
#include <utility>

namespace clamor {

namespace {

// The zone takes over between these counts of edges.
constexpr std::size_t kClean = 24, kCluttered = 40;
constexpr double kReach = 2;           // wavelengths of detour within which edges matter
constexpr std::size_t kMaxOfPair = 8;  // edges in sight of an end that are paired
constexpr double kMinMean = 0.1;       // length of a mean of unit directions that cancel out

}  // namespace

DiffractionPaths::DiffractionPaths(const OcclusionGeometry& geometry, const PathEnd& from,
                                   const PathEnd& to, double speed_of_sound_mps,
                                   std::vector<EdgeBetween> found, bool are_paired,
                                   std::uint64_t& rays)
    : geometry_(geometry),
      from_(from),
      to_(to),
      speed_of_sound_mps_(speed_of_sound_mps),
      rays_(rays),
      found_(std::move(found)) {
  edges_.reserve(found_.size());
  add_single_edges();
  if (are_paired) add_pairs();
}

float DiffractionPaths::clutter(std::size_t band) const {
  const double first_m = heard_ ? nearest_heard_m_ : in_sight_.empty() ? 0 : in_sight_[0];
  const double reach_m = first_m + kReach * wavelength_m(band, speed_of_sound_mps_);
  const auto count = static_cast<double>(
      std::ranges::count_if(in_sight_, [&](double detour_m) { return detour_m < reach_m; }));
  return static_cast<float>(
      std::clamp((count - kClean) / static_cast<double>(kCluttered - kClean), 0.0, 1.0));
}

void DiffractionPaths::add(EdgeSound sound) {
  if (!sound.is_heard) return;
  const double detour_m = sound.path_m - length(to_.seen_m - from_.seen_m);
  nearest_heard_m_ = heard_ ? std::min(nearest_heard_m_, detour_m) : detour_m;
  heard_ = true;
  sounds_.push_back(sound);
}

void DiffractionPaths::add_single_edges() {
  const double lowest_m = kReach * wavelength_m(0, speed_of_sound_mps_);
  for (std::size_t i = 0; i < found_.size(); ++i) {
    if (heard_ && found_[i].detour_m > nearest_heard_m_ + lowest_m) return;
    const EdgeInAir& edge =
        edges_.emplace_back(geometry_, found_[i].edge, speed_of_sound_mps_, rays_);
    EdgeSound sound = sound_over_edge(edge, from_, to_);
    if (sound.is_seen_by_source && seen_by_source_.size() < kMaxOfPair)
      seen_by_source_.push_back(i);
    if (sound.is_seen_by_listener && seen_by_listener_.size() < kMaxOfPair)
      seen_by_listener_.push_back(i);
    if (sound.is_seen_by_source || sound.is_seen_by_listener)
      in_sight_.push_back(found_[i].detour_m);
    add(sound);
  }
}

void DiffractionPaths::add_pairs() {
  for (const std::size_t i : seen_by_source_)
    for (const std::size_t j : seen_by_listener_)
      if (i != j) add(sound_over_edges(edges_[i], edges_[j], from_, to_));
}

std::optional<BentPath> mean_path(const LineOfSight& line, std::span<const EdgeSound> sounds) {
  const Vec3 from_m(line.from_m), to_m(line.to_m);
  Vec3 arrives(0), leaves(0);
  double path_m = 0, sum = 0;
  for (const EdgeSound& sound : sounds) {
    const double power = sum_of(power_of(sound.pressure)), weight = power * power;
    if (!(weight > 0 && sound.first_m != from_m && sound.last_m != to_m)) continue;
    arrives += weight * normalize(sound.last_m - to_m);
    leaves += weight * normalize(sound.first_m - from_m);
    path_m += weight * sound.path_m;
    sum += weight;
  }
  if (!(length(arrives) > kMinMean * sum && length(leaves) > kMinMean * sum)) return std::nullopt;
  return BentPath{Vec3f(to_m + path_m / sum * normalize(arrives)), Vec3f(normalize(leaves))};
}

BentPath blend(const LineOfSight& line, const BentPath& path, double share) {
  const Vec3 to_source_m = Vec3(line.from_m) - Vec3(line.to_m);
  const Vec3 to_path_m = Vec3(path.heard_at_m) - Vec3(line.to_m);
  const double straight_m = length(to_source_m), path_m = length(to_path_m);
  if (!(straight_m > 0 && path_m > 0)) return path;
  const Vec3 straight = to_source_m / straight_m;
  const Vec3 arrives = share / path_m * to_path_m + (1 - share) * straight;
  const Vec3 leaves = share * Vec3(path.leaves) - (1 - share) * straight;
  if (!(length(arrives) > kMinMean && length(leaves) > kMinMean)) return path;
  const double distance_m = share * path_m + (1 - share) * straight_m;
  return {Vec3f(Vec3(line.to_m) + distance_m * normalize(arrives)), Vec3f(normalize(leaves))};
}

}  // namespace clamor
