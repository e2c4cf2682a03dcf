#include "bake/probes/probe_thinning.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bake/probes/air_lattice.h"

namespace clamor {

namespace {

// Weight of a change of view on the distance. With 2, a doorway of 1.5 m keeps one probe, half of
// whose sound is in the wrong room for a source a metre away: errors of EDT of 20 %.
constexpr double kChangeWeight = 3;
constexpr double kAlwaysNear = 1.0 / 3;  // share of the spacing within which views are not compared
constexpr double kMuchOfAView = 0.5;
constexpr double kAboveFloor = 0.75;  // of its spacing, between a probe in the air and one below

}  // namespace

ProbeThinning::ProbeThinning(const Scene& scene, const std::vector<Vec3>& hand_placed_m,
                             double spacing_m, ProbeThinningBy by)
    : scene_(scene),
      hand_placed_m_(hand_placed_m),
      spacing_m_(spacing_m),
      bucket_m_(2 * spacing_m),
      by_(by) {}

ProbeThinning::Bucket ProbeThinning::bucket_of(const Vec3& place_m) const {
  Bucket bucket;
  for (int axis = 0; axis < 3; ++axis)
    bucket[static_cast<std::size_t>(axis)] =
        static_cast<long long>(std::floor(place_m[axis] / bucket_m_));
  return bucket;
}

// Nearest first, so that most candidates are replaced by the first.
std::vector<const ProbeCandidate*> ProbeThinning::near(const Vec3& place_m, double within_m) const {
  std::vector<std::pair<double, const ProbeCandidate*>> found;
  const Bucket middle = bucket_of(place_m);
  const auto reach = static_cast<long long>(std::ceil(within_m / bucket_m_));
  for (long long x = -reach; x <= reach; ++x)
    for (long long y = -reach; y <= reach; ++y)
      for (long long z = -reach; z <= reach; ++z) {
        const auto bucket = buckets_.find({middle[0] + x, middle[1] + y, middle[2] + z});
        if (bucket == buckets_.end()) continue;
        for (const ProbeCandidate* kept : bucket->second) {
          const double distance_m = length(kept->place_m - place_m);
          if (distance_m < within_m) found.emplace_back(distance_m, kept);
        }
      }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<const ProbeCandidate*> nearest;
  for (const auto& [distance_m, kept] : found) nearest.push_back(kept);
  return nearest;
}

bool ProbeThinning::is_replaced_by(const ProbeCandidate& kept, const ProbeCandidate& candidate,
                                   double spacing_m) const {
  const double distance_m = length(kept.place_m - candidate.place_m);
  if (candidate.is_in_air && !kept.is_in_air && distance_m >= kAboveFloor * spacing_m) return false;
  if (by_ == ProbeThinningBy::kDistance) return true;
  if (!is_free(scene_, candidate.place_m, kept.place_m)) return false;
  if (candidate.is_in_air || distance_m < kAlwaysNear * spacing_m) return true;
  const double change =
      view_change(scene_, candidate.place_m, candidate.view, kept.place_m, kept.view);
  return distance_m * (1 + kChangeWeight * change) < spacing_m;
}

bool ProbeThinning::offer(const ProbeCandidate& candidate, double spacing_m) {
  for (const Vec3& hand_placed_m : hand_placed_m_)
    if (length(hand_placed_m - candidate.place_m) < 0.5 * spacing_m_) return false;
  for (const ProbeCandidate* kept : near(candidate.place_m, spacing_m))
    if (is_replaced_by(*kept, candidate, spacing_m)) return false;
  kept_.push_back(&candidate);
  buckets_[bucket_of(candidate.place_m)].push_back(&candidate);
  return true;
}

bool ProbeThinning::has_companion(const ProbeCandidate& candidate, double within_m) const {
  for (const ProbeCandidate* kept : near(candidate.place_m, within_m)) {
    if (kept == &candidate || !is_free(scene_, candidate.place_m, kept->place_m)) continue;
    if (view_change(scene_, candidate.place_m, candidate.view, kept->place_m, kept->view) <
        kMuchOfAView)
      return true;
  }
  return false;
}

}  // namespace clamor
