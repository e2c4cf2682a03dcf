#include "bake/probes/probe_candidates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace clamor {

namespace {

constexpr double kTight_m = 0.1;  // least distance from a surface, in levels of 10 m or more
constexpr double kReach_m = 60;   // length of rays that meet nothing
constexpr double kOutsideEscapes = 0.25;  // share of rays that escapes outside a closed level

// Surfaces show their fronts if at most kFewBehind of the rays meet a back; a place that mostly
// sees backs then lies in a solid.
constexpr double kFewBehind = 0.15, kInSolidBehind = 0.6;

// Least change of the view. With 0.6 a doorway 1.5 m wide would not be an opening.
constexpr double kOpening = 0.45;
constexpr int kOpeningStrides = 2;       // distance at which views are compared
constexpr std::size_t kOpeningRays = 3;  // every third ray
constexpr std::size_t kMaxInAir = 8000;

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

bool is_in_solid(const ProbeView& view) {
  return share(view.behind, ProbeView::kRays - view.escaped) > kInSolidBehind;
}

}  // namespace

ProbeCandidates::ProbeCandidates(const Scene& scene, const ReachableAir& air,
                                 const std::vector<FloorSpot>& floor, double apart_m,
                                 std::size_t max_count)
    : scene_(scene), air_(air) {
  const AirLattice& lattice = air.lattice();
  reach_m_ = std::min(kReach_m, air.extent_m());
  tight_m_ = std::min(kTight_m, 0.01 * air.extent_m());
  stride_ = std::max(1, static_cast<int>(std::lround(apart_m / lattice.cell_m())));
  const auto count = static_cast<double>(floor.size());
  while (count / (stride_ * stride_) > static_cast<double>(max_count)) ++stride_;
  for (const FloorSpot& spot : floor) {
    if (!is_on_lattice(spot.cell, 0, stride_) || !is_on_lattice(spot.cell, 2, stride_)) continue;
    auto candidate = candidate_at(spot.ear_m);
    if (!candidate) continue;
    candidate->is_roof = spot.is_roof;
    on_floor_.push_back(*candidate);
    cells_.push_back(spot.cell);
  }
  drop_solids();
}

bool ProbeCandidates::is_on_lattice(const LatticeCell& cell, int axis, int stride) const {
  return air_.lattice().world(axis, cell[static_cast<std::size_t>(axis)]) % stride == 0;
}

std::optional<ProbeCandidate> ProbeCandidates::candidate_at(const Vec3& place_m) const {
  ProbeCandidate candidate;
  candidate.place_m = place_m;
  candidate.view = view_from(scene_, place_m, reach_m_);
  if (candidate.view.clearance_m < tight_m_) return std::nullopt;
  if (air_.is_closed() && share(candidate.view.escaped, ProbeView::kRays) > kOutsideEscapes)
    return std::nullopt;
  return candidate;
}

void ProbeCandidates::drop_solids() {
  std::size_t behind = 0, hits = 0;
  for (const ProbeCandidate& candidate : on_floor_) {
    behind += candidate.view.behind;
    hits += ProbeView::kRays - candidate.view.escaped;
  }
  has_winding_ = share(behind, hits) <= kFewBehind;
  if (!has_winding_) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < on_floor_.size(); ++i) {
    if (is_in_solid(on_floor_[i].view)) continue;
    on_floor_[kept] = on_floor_[i];
    cells_[kept++] = cells_[i];
  }
  on_floor_.resize(kept);
  cells_.resize(kept);
}

std::vector<const ProbeCandidate*> ProbeCandidates::regular(double spacing_m) const {
  const auto steps = std::max(1L, std::lround(spacing_m / apart_m()));
  const int stride = stride_ * static_cast<int>(std::min(steps, 1'000'000L));
  std::vector<const ProbeCandidate*> found;
  for (std::size_t i = 0; i < on_floor_.size(); ++i)
    if (is_on_lattice(cells_[i], 0, stride) && is_on_lattice(cells_[i], 2, stride))
      found.push_back(&on_floor_[i]);
  return found;
}

std::vector<ProbeOpening> ProbeCandidates::openings() const {
  std::map<std::array<int, 2>, std::vector<std::size_t>> columns;
  for (std::size_t i = 0; i < cells_.size(); ++i)
    columns[{cells_[i][0], cells_[i][2]}].push_back(i);
  const int step = kOpeningStrides * stride_;
  std::vector<ProbeOpening> found;
  for (std::size_t i = 0; i < cells_.size(); ++i)
    for (const auto& [dx, dz] : {std::pair{step, 0}, {0, step}}) {
      const auto column = columns.find({cells_[i][0] + dx, cells_[i][2] + dz});
      if (column == columns.end()) continue;
      for (const std::size_t j : column->second) {
        const ProbeCandidate &a = on_floor_[i], &b = on_floor_[j];
        if (std::abs(a.place_m.y - b.place_m.y) > kOpeningStrides * apart_m() ||
            !is_free(scene_, a.place_m, b.place_m))
          continue;
        const double change =
            view_change(scene_, a.place_m, a.view, b.place_m, b.view, kOpeningRays);
        if (change >= kOpening) found.push_back({&a, &b, change});
      }
    }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.change > b.change; });
  return found;
}

std::vector<ProbeCandidate> ProbeCandidates::in_air(double apart_m, double high_m) const {
  const AirLattice& lattice = air_.lattice();
  int stride = std::max(1, static_cast<int>(std::min(1e6, apart_m / lattice.cell_m())));
  const double cells = static_cast<double>(lattice.count(0)) * lattice.count(1) * lattice.count(2);
  while (cells / (static_cast<double>(stride) * stride * stride) > kMaxInAir) ++stride;
  std::vector<ProbeCandidate> found;
  for (int y = 0; y < lattice.count(1); ++y)
    for (int x = 0; x < lattice.count(0); ++x)
      for (int z = 0; z < lattice.count(2); ++z) {
        const LatticeCell cell = {x, y, z};
        if (!is_on_lattice(cell, 0, stride) || !is_on_lattice(cell, 1, stride) ||
            !is_on_lattice(cell, 2, stride) || !lattice.is_reached(cell))
          continue;
        const Vec3 place_m = lattice.centre_m(cell);
        if (place_m.y > high_m) continue;
        auto candidate = candidate_at(place_m);
        if (!candidate || (has_winding_ && is_in_solid(candidate->view)) ||
            2 * candidate->view.escaped > ProbeView::kRays)
          continue;
        candidate->is_in_air = true;
        found.push_back(*candidate);
      }
  return found;
}

}  // namespace clamor
