// probe_candidates.h: the places that are considered for probes.
//
// Candidates lie above the floor at ear height and, sparsely, in the air above, on a lattice that
// is anchored to world coordinates. Those in solids, outside of closed levels or at surfaces are
// left out.
//
// Threads: one.
#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "bake/probes/floor_spots.h"
#include "bake/probes/probe_thinning.h"
#include "bake/probes/reachable_air.h"
#include "bake/trace/scene.h"

namespace clamor {

// Pairs of candidates whose views differ: an opening lies between them.
struct ProbeOpening {
  const ProbeCandidate *one = nullptr, *other = nullptr;
  double change = 0;
};

class ProbeCandidates {
 public:
  // Scene and air must outlive the object. `apart_m` is the wanted distance of candidates; it is
  // increased until about `max_count` remain.
  ProbeCandidates(const Scene& scene, const ReachableAir& air, const std::vector<FloorSpot>& floor,
                  double apart_m, std::size_t max_count);

  // In the order of the lattice.
  const std::vector<ProbeCandidate>& on_floor() const { return on_floor_; }
  double apart_m() const { return stride_ * air_.lattice().cell_m(); }

  // The candidates on a square lattice of about this spacing, which makes placements regular.
  std::vector<const ProbeCandidate*> regular(double spacing_m) const;

  // Most different views first.
  std::vector<ProbeOpening> openings() const;

  // Candidates about `apart_m` apart, up to `high_m`, that have surfaces on half of all sides.
  std::vector<ProbeCandidate> in_air(double apart_m, double high_m) const;

 private:
  bool is_on_lattice(const LatticeCell& cell, int axis, int stride) const;
  std::optional<ProbeCandidate> candidate_at(const Vec3& place_m) const;
  void drop_solids();

  const Scene& scene_;
  const ReachableAir& air_;
  double reach_m_ = 0, tight_m_ = 0;
  int stride_ = 1;
  bool has_winding_ = false;  // surfaces show their fronts
  std::vector<ProbeCandidate> on_floor_;
  std::vector<LatticeCell> cells_;  // of the candidates
};

}  // namespace clamor
