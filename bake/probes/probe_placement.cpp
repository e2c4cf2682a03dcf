#include "bake/probes/probe_placement.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "bake/probes/probe_candidates.h"
#include "bake/probes/probe_messages.h"
#include "bake/probes/probe_thinning.h"
#include "bake/probes/reachable_air.h"
#include "formats/level/level.h"

namespace clamor {

namespace {

// The automatic spacing is this factor times the square root of the mean free path: 2 m in a living
// room, 3 m in a church, 8 m in a stadium.
constexpr double kSpacingOfRoot = 1.28;

constexpr double kSpacingOfPath = 0.8;     // of the mean free path, at most
constexpr double kLeastShare = 0.25;       // of the spacing, in the smallest rooms
constexpr double kRoofShare = 2;           // of the spacing, on roofs
constexpr double kAirShare = 2;            // of the spacing, in the air
constexpr double kOpenAirShare = 4;        // the same in wide open air
constexpr double kAirSpacingOfPath = 0.5;  // of the mean free path, between these two
constexpr double kAirClearance = 0.15;     // of the spacing, from surfaces in the air
constexpr double kOpeningShare = 0.5;      // of the spacing, at openings
constexpr double kClearance_m = 0.3;       // wanted distance from surfaces, in levels of 10 m
constexpr double kPairedRoom_m3 = 5;       // rooms with at least two probes
constexpr double kCompanion = 2;           // of the spacing: a companion is at most this far
constexpr double kApart_m = 0.5;           // distance of candidates
constexpr std::size_t kMaxCandidates = 12'000;
constexpr double kCandidatesPerProbe = 6;  // at least, where the spacing is given

class ProbePlacer {
 public:
  ProbePlacer(const Scene& scene, const std::vector<Vec3>& hand_placed_m, const ReachableAir& air,
              const ProbeCandidates& candidates)
      : scene_(scene),
        hand_placed_m_(hand_placed_m),
        air_(air),
        candidates_(candidates),
        clearance_m_(std::min(kClearance_m, 0.03 * air.extent_m())),
        openings_(candidates.openings()) {}

  std::vector<Vec3> place(double spacing_m, ProbeThinningBy by = ProbeThinningBy::kViews) const {
    ProbeThinning thinning(scene_, hand_placed_m_, spacing_m, by);
    const bool by_views = by == ProbeThinningBy::kViews;
    if (by_views) offer_openings(thinning, spacing_m);
    offer_floor(thinning, spacing_m, by_views ? kLeastShare : 1);
    if (by_views) add_companions(thinning, spacing_m);
    const auto in_air = candidates_.in_air(0.25 * kAirShare * spacing_m,
                                           air_.high_m() + (air_.is_closed() ? 0 : spacing_m));
    for (const ProbeCandidate& candidate : in_air)
      if (candidate.view.clearance_m >= std::max(clearance_m_, kAirClearance * spacing_m))
        thinning.offer(candidate, air_spacing_at(candidate, spacing_m));
    std::vector<Vec3> places_m;
    for (const ProbeCandidate* kept : thinning.kept()) places_m.push_back(kept->place_m);
    return places_m;
  }

 private:
  // The square lattice comes first, then what it leaves open, far from surfaces first.
  void offer_floor(ProbeThinning& thinning, double spacing_m, double min_share) const {
    const auto offer = [&](const ProbeCandidate& candidate, double clearance_m) {
      if (candidate.view.clearance_m >= clearance_m)
        thinning.offer(candidate, spacing_at(candidate, spacing_m, min_share));
    };
    for (const ProbeCandidate* candidate : candidates_.regular(spacing_m))
      offer(*candidate,
            std::max(clearance_m_, 0.25 * spacing_at(*candidate, spacing_m, min_share)));
    for (const double clearance_m : {0.5 * spacing_m, 0.25 * spacing_m, clearance_m_, 0.0})
      for (const ProbeCandidate& candidate : candidates_.on_floor()) offer(candidate, clearance_m);
  }

  static double spacing_at(const ProbeCandidate& candidate, double spacing_m, double min_share) {
    if (candidate.is_roof) return kRoofShare * spacing_m;
    return std::clamp(kSpacingOfPath * candidate.view.mean_free_path_m, min_share * spacing_m,
                      spacing_m);
  }

  static double air_spacing_at(const ProbeCandidate& candidate, double spacing_m) {
    return std::clamp(kAirSpacingOfPath * candidate.view.mean_free_path_m, kAirShare * spacing_m,
                      kOpenAirShare * spacing_m);
  }

  // Both sides of an opening are kept: the change between them more than doubles their distance.
  void offer_openings(ProbeThinning& thinning, double spacing_m) const {
    for (const ProbeOpening& opening : openings_) {
      const double sides_m = length(opening.one->place_m - opening.other->place_m);
      for (const ProbeCandidate* side : {opening.one, opening.other})
        if (side->view.clearance_m >= clearance_m_ && !side->is_roof)
          thinning.offer(*side, std::min(kOpeningShare * spacing_m, 2 * sides_m));
    }
  }

  // Gives a lone probe in a room a second one, as far away as it sees.
  void add_companions(ProbeThinning& thinning, double spacing_m) const {
    const std::vector<const ProbeCandidate*> kept = thinning.kept();
    for (const ProbeCandidate* probe : kept) {
      const double radius_m = 0.75 * probe->view.mean_free_path_m;
      if (4.19 * radius_m * radius_m * radius_m < kPairedRoom_m3 || probe->is_roof ||
          thinning.has_companion(*probe, kCompanion * spacing_m))
        continue;
      const ProbeCandidate* farthest = nullptr;
      double farthest_m = 0;
      for (const ProbeCandidate& other : candidates_.on_floor()) {
        const double distance_m = length(other.place_m - probe->place_m);
        if (distance_m <= farthest_m || distance_m > spacing_m ||
            other.view.clearance_m < clearance_m_ ||
            !is_free(scene_, probe->place_m, other.place_m))
          continue;
        farthest = &other;
        farthest_m = distance_m;
      }
      if (farthest != nullptr) thinning.offer(*farthest, farthest_m);
    }
  }

  const Scene& scene_;
  const std::vector<Vec3>& hand_placed_m_;
  const ReachableAir& air_;
  const ProbeCandidates& candidates_;
  double clearance_m_;
  std::vector<ProbeOpening> openings_;
};

// Roofs do not count: sources are mostly below them.
double automatic_spacing_m(const ProbeCandidates& candidates) {
  std::vector<double> paths_m, roof_paths_m;
  for (const ProbeCandidate& candidate : candidates.on_floor())
    (candidate.is_roof ? roof_paths_m : paths_m).push_back(candidate.view.mean_free_path_m);
  if (paths_m.empty()) paths_m = roof_paths_m;
  const auto median = paths_m.begin() + static_cast<std::ptrdiff_t>(paths_m.size() / 2);
  std::nth_element(paths_m.begin(), median, paths_m.end());
  return kSpacingOfRoot * std::sqrt(*median);
}

// Widens the spacing until the probes are few enough. Where that does not help, because everything
// hides everything, begins again with thinning by distance alone.
void place_few(const ProbePlacer& placer, std::size_t max_count, double first_m,
               ProbePlacement& placement) {
  constexpr int kTriesByViews = 3, kTriesByDistance = 8;
  const auto limit = static_cast<double>(max_count);
  std::vector<Vec3> places_m;
  for (const ProbeThinningBy by : {ProbeThinningBy::kViews, ProbeThinningBy::kDistance}) {
    double spacing_m = first_m;
    const int tries = by == ProbeThinningBy::kViews ? kTriesByViews : kTriesByDistance;
    for (int i = 0; i < tries; ++i) {
      placement.spacing_m = spacing_m;
      places_m = placer.place(spacing_m, by);
      if (places_m.size() <= max_count) break;
      const auto count = static_cast<double>(places_m.size());
      spacing_m *= 1.03 * std::sqrt(count / std::max(1.0, limit));
    }
    if (places_m.size() <= max_count) break;
  }
  if (places_m.size() > max_count) places_m.resize(max_count);
  placement.positions_m.insert(placement.positions_m.end(), places_m.begin(), places_m.end());
}

Error too_many(double spacing_m, double count) {
  const double enough_m = 1.1 * spacing_m * std::sqrt(count / ProbePlacement::kMaxProbes);
  return Error(fmt::format(
      "a probe every {:.4g} m would make about {:.0f} of them, and {} are the most; use a spacing "
      "of {:.2g} m or more.",
      spacing_m, count, ProbePlacement::kMaxProbes, enough_m));
}

Result<void> check(const Level& level, const ProbeOptions& options) {
  if (level.probes_m.size() > ProbePlacement::kMaxProbes)
    return Error(fmt::format("the level has {} probes, and {} are the most; thin them out.",
                             level.probes_m.size(), ProbePlacement::kMaxProbes));
  const bool is_spacing = std::isfinite(options.spacing_m) && options.spacing_m > 0;
  if (options.placement == ProbeOptions::Placement::kSpacing && !is_spacing)
    return Error(
        fmt::format("the spacing of probes is {} m; give a number above 0.", options.spacing_m));
  return {};
}

// Hand-placed probes keep their places, and the others keep away from them.
Result<void> add_automatic(const Scene& scene, const Level& level, const ProbeOptions& options,
                           ProbePlacement& placement) {
  const bool has_spacing = options.placement == ProbeOptions::Placement::kSpacing;
  const ReachableAir air(scene, level, has_spacing ? options.spacing_m : 1e9);
  const double cell_m = air.lattice().cell_m();
  const std::vector<FloorSpot> floor = find_floor(scene, air.lattice());
  placement.floor_m2 = static_cast<double>(floor.size()) * cell_m * cell_m;

  double spacing_m = has_spacing ? std::min(options.spacing_m, air.extent_m()) : 0;
  double apart_m = std::min(kApart_m, 2 * cell_m);
  double max_candidates = kMaxCandidates;
  if (has_spacing) {
    const double expected = placement.floor_m2 / (spacing_m * spacing_m);
    if (!(expected <= ProbePlacement::kMaxProbes)) return too_many(options.spacing_m, expected);
    apart_m = std::min(apart_m, 0.25 * spacing_m);
    max_candidates = std::max(max_candidates, kCandidatesPerProbe * expected);
  }
  const ProbeCandidates candidates(scene, air, floor, apart_m,
                                   static_cast<std::size_t>(max_candidates));
  if (candidates.on_floor().empty()) return {};
  const ProbePlacer placer(scene, level.probes_m, air, candidates);
  if (!has_spacing) {
    place_few(placer, options.max_automatic, automatic_spacing_m(candidates), placement);
    return {};
  }
  const std::vector<Vec3> places_m = placer.place(spacing_m);
  const auto count = static_cast<double>(places_m.size() + placement.hand_placed);
  if (count > ProbePlacement::kMaxProbes) return too_many(spacing_m, count);
  placement.spacing_m = spacing_m;
  placement.positions_m.insert(placement.positions_m.end(), places_m.begin(), places_m.end());
  return {};
}

}  // namespace

Result<ProbePlacement> place_probes(const Scene& scene, const Level& level,
                                    const ProbeOptions& options) {
  if (const auto ok = check(level, options); !ok.ok()) return ok.error();
  ProbePlacement placement;
  if (level.mesh.triangles.empty()) {
    if (!level.probes_m.empty())
      placement.warnings.push_back(
          "the level has probes but no surfaces, so nothing is reflected; the probes are left out");
    return placement;
  }
  placement.positions_m = level.probes_m;
  placement.hand_placed = level.probes_m.size();
  placement.warnings = probe_warnings(scene, level);
  if (options.placement == ProbeOptions::Placement::kNone) return placement;
  if (const auto ok = add_automatic(scene, level, options, placement); !ok.ok()) return ok.error();
  if (placement.positions_m.size() == placement.hand_placed)
    placement.warnings.push_back(
        "no probe was placed, because no emitter and no hand-placed probe lies in the air above a "
        "floor; move one there, or add a probe by hand");
  return placement;
}

}  // namespace clamor
