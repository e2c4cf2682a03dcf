#include "runtime/occlusion/direct_sound.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "runtime/occlusion/edge_diffraction.h"

namespace clamor {

namespace {

// Edges beyond this many take no part. The zone takes over between the two other counts.
constexpr std::size_t kMaxEdges = 64, kClean = 24, kCluttered = 40;
constexpr double kLongestDetour_m = 40;
constexpr double kReach = 2;           // wavelengths of detour within which edges matter
constexpr std::size_t kMaxOfPair = 8;  // edges in sight of an end that are paired
constexpr float kLeastOfZone = 0.03f;
// Edges beside a free line count fully where the zones of all bands together lack half of a band's
// power.
constexpr double kWholeEffect = 0.5;
constexpr double kMinMean = 0.1;  // length of a mean of unit directions that cancel out

// All ways around edges from a source to a listener.
class WaysAround {
 public:
  WaysAround(const OcclusionGeometry& geometry, const LineOfSight& line, std::uint64_t& rays)
      : geometry_(geometry),
        from_m_(line.from_m),
        to_m_(line.to_m),
        speed_of_sound_mps_(line.speed_of_sound_mps),
        rays_(rays) {
    geometry.find_edges(from_m_, to_m_, kMaxEdges, kLongestDetour_m, found_);
    edges_.reserve(found_.size());
    add_single_edges();
    add_pairs();
  }

  const std::vector<EdgeSound>& sounds() const { return sounds_; }

  // From 0 where few edges matter in a band to 1 where so many do that the zone knows better.
  float clutter(std::size_t band) const {
    const double first_m = heard_ ? nearest_heard_m_ : in_sight_.empty() ? 0 : in_sight_[0];
    const double reach_m = first_m + kReach * wavelength_m(band, speed_of_sound_mps_);
    const auto count = static_cast<double>(
        std::ranges::count_if(in_sight_, [&](double detour_m) { return detour_m < reach_m; }));
    return static_cast<float>(
        std::clamp((count - kClean) / static_cast<double>(kCluttered - kClean), 0.0, 1.0));
  }

 private:
  void add(EdgeSound sound) {
    if (!sound.is_heard) return;
    const double detour_m = sound.path_m - length(to_m_ - from_m_);
    nearest_heard_m_ = heard_ ? std::min(nearest_heard_m_, detour_m) : detour_m;
    heard_ = true;
    sounds_.push_back(sound);
  }

  void add_single_edges() {
    const double lowest_m = kReach * wavelength_m(0, speed_of_sound_mps_);
    for (std::size_t i = 0; i < found_.size(); ++i) {
      if (heard_ && found_[i].detour_m > nearest_heard_m_ + lowest_m) return;
      const EdgeInAir& edge = edges_.emplace_back(geometry_, found_[i].edge, rays_);
      EdgeSound sound = sound_over_edge(edge, from_m_, to_m_, speed_of_sound_mps_);
      if (sound.is_seen_by_source && seen_by_source_.size() < kMaxOfPair)
        seen_by_source_.push_back(i);
      if (sound.is_seen_by_listener && seen_by_listener_.size() < kMaxOfPair)
        seen_by_listener_.push_back(i);
      if (sound.is_seen_by_source || sound.is_seen_by_listener)
        in_sight_.push_back(found_[i].detour_m);
      add(sound);
    }
  }

  void add_pairs() {
    for (const std::size_t i : seen_by_source_)
      for (const std::size_t j : seen_by_listener_)
        if (i != j)
          add(sound_over_edges(geometry_, edges_[i], edges_[j], from_m_, to_m_, speed_of_sound_mps_,
                               rays_));
  }

  const OcclusionGeometry& geometry_;
  Vec3 from_m_, to_m_;
  double speed_of_sound_mps_;
  std::uint64_t& rays_;
  std::vector<EdgeBetween> found_;
  std::vector<EdgeInAir> edges_;
  std::vector<double> in_sight_;  // detours of the edges that an end sees
  std::vector<std::size_t> seen_by_source_, seen_by_listener_;
  std::vector<EdgeSound> sounds_;
  bool heard_ = false;
  double nearest_heard_m_ = 0;
};

// The mean over all ways, the louder ones by far the most.
std::optional<BentPath> mean_path(const LineOfSight& line, const std::vector<EdgeSound>& sounds) {
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

}  // namespace

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

DirectSound direct_sound(const OcclusionGeometry& geometry, const LineOfSight& line,
                         const Bands& zone, bool line_is_free, std::uint64_t& rays) {
  DirectSound direct{.visibility = zone};
  if (line_is_free && zone == same_in_all_bands(1)) return direct;
  const WaysAround ways(geometry, line, rays);
  Tones pressure{};
  if (line_is_free) pressure.fill(1);
  for (const EdgeSound& sound : ways.sounds())
    for (std::size_t i = 0; i < kTones; ++i) pressure[i] += sound.pressure[i];
  Bands power = power_of(pressure);
  if (line_is_free) {
    // Edges take effect by degrees where they enter the zone.
    const double blocked = static_cast<double>(kBandCount) - sum_of(zone);
    const float effect = static_cast<float>(std::min(1.0, blocked / kWholeEffect));
    for (float& share : power) share = 1 + effect * (share - 1);
  }
  double clutter = 0;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const float share = ways.clutter(b);
    const float least = line_is_free ? 0 : kLeastOfZone * zone[b];
    direct.visibility[b] = (1 - share) * std::max(power[b], least) + share * zone[b];
    clutter += static_cast<double>(share) / kBandCount;
  }
  direct.is_over_edges = !ways.sounds().empty();
  if (!line_is_free) direct.bent = mean_path(line, ways.sounds());
  if (direct.bent) direct.bent = blend(line, *direct.bent, 1 - clutter);
  return direct;
}

}  // namespace clamor
