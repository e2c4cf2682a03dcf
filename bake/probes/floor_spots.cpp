#include "bake/probes/floor_spots.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "common/bounds.h"

namespace clamor {

namespace {

constexpr double kWalkable = 0.7;     // least vertical part of a floor's normal: 45 degrees
constexpr double kEarHeight_m = 1.5;  // above the floor
constexpr double kHeadroom_m = 1;     // least free height, in levels that are higher than 4 m
constexpr double kStair_m = 0.3;      // greatest step within a patch
constexpr double kPatch_m2 = 2;       // least area of a patch, in levels with 100 m2 of floor
constexpr double kPatchShare = 0.02;  // of the floor, in smaller levels
constexpr double kNarrow = 0.6;       // least width of a patch over the root of its least area

const Vec3 kUp(0, 1, 0);

class FloorFinder {
 public:
  FloorFinder(const Scene& scene, const AirLattice& lattice) : scene_(scene), lattice_(lattice) {
    headroom_m_ = std::min(kHeadroom_m, 0.25 * lattice.count(1) * lattice.cell_m());
  }

  std::vector<FloorSpot> find() {
    for (int x = 0; x < lattice_.count(0); ++x)
      for (int z = 0; z < lattice_.count(2); ++z) {
        columns_.push_back(spots_.size());
        for (int y = 0; y < lattice_.count(1); ++y)
          if (const auto spot = spot_under({x, y, z})) spots_.push_back(*spot);
      }
    columns_.push_back(spots_.size());
    visited_.assign(spots_.size(), false);
    kept_.assign(spots_.size(), true);
    for (std::size_t i = 0; i < spots_.size(); ++i)
      if (!visited_[i]) judge_patch(patch_from(i));
    std::vector<FloorSpot> kept;
    for (std::size_t i = 0; i < spots_.size(); ++i)
      if (kept_[i]) kept.push_back(spots_[i]);
    return kept;
  }

 private:
  // The floor between this cell and the one below it, if there is one.
  std::optional<FloorSpot> spot_under(const LatticeCell& cell) const {
    if (!lattice_.is_reached(cell)) return std::nullopt;
    if (cell[1] > 0 && lattice_.is_linked({cell[0], cell[1] - 1, cell[2]}, 1)) return std::nullopt;
    const Vec3 centre_m = lattice_.centre_m(cell);
    const auto below = scene_.intersect(centre_m, -kUp);
    if (!below || below->normal.y < kWalkable) return std::nullopt;
    const auto above = scene_.intersect(centre_m, kUp);
    FloorSpot spot;
    spot.cell = cell;
    spot.floor_m = centre_m.y - below->distance_m;
    spot.is_open = !above;
    double ear_m = kEarHeight_m;
    if (above) {
      const double free_m = below->distance_m + above->distance_m;
      if (free_m < headroom_m_) return std::nullopt;
      ear_m = std::min(ear_m, free_m / 2);
    }
    spot.ear_m = Vec3(centre_m.x, spot.floor_m + ear_m, centre_m.z);
    return spot;
  }

  // All spots that can be walked to.
  std::vector<std::size_t> patch_from(std::size_t first) {
    const double step_m = std::max(kStair_m, lattice_.cell_m());
    std::vector<std::size_t> patch = {first};
    visited_[first] = true;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      const FloorSpot& spot = spots_[patch[i]];
      for (const auto& [dx, dz] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        const int x = spot.cell[0] + dx, z = spot.cell[2] + dz;
        if (x < 0 || z < 0 || x >= lattice_.count(0) || z >= lattice_.count(2)) continue;
        const auto column =
            static_cast<std::size_t>(x) * static_cast<std::size_t>(lattice_.count(2)) +
            static_cast<std::size_t>(z);
        for (std::size_t next = columns_[column]; next < columns_[column + 1]; ++next) {
          if (visited_[next] || std::abs(spots_[next].floor_m - spot.floor_m) > step_m) continue;
          visited_[next] = true;
          patch.push_back(next);
        }
      }
    }
    return patch;
  }

  // The area of a patch over its length.
  double width_m(const std::vector<std::size_t>& patch) const {
    const Bounds ears = bounds_of(patch, [&](std::size_t spot) { return spots_[spot].ear_m; });
    const Vec3 size_m = ears.high_m - ears.low_m + lattice_.cell_m();
    return area_m2(patch.size()) / std::sqrt(size_m.x * size_m.x + size_m.z * size_m.z);
  }

  double area_m2(std::size_t spots) const {
    return static_cast<double>(spots) * lattice_.cell_m() * lattice_.cell_m();
  }

  bool is_lowest(std::size_t spot) const {
    return spot == 0 || spots_[spot - 1].cell[0] != spots_[spot].cell[0] ||
           spots_[spot - 1].cell[2] != spots_[spot].cell[2];
  }

  // Marks roofs, and drops small patches and narrow ones, such as parapets.
  void judge_patch(const std::vector<std::size_t>& patch) {
    const double small_m2 = std::min(kPatch_m2, kPatchShare * area_m2(spots_.size()));
    if (area_m2(patch.size()) < small_m2 || width_m(patch) < kNarrow * std::sqrt(small_m2)) {
      for (const std::size_t spot : patch) kept_[spot] = false;
      return;
    }
    std::size_t open = 0, above = 0;
    for (const std::size_t spot : patch) {
      open += spots_[spot].is_open;
      above += !is_lowest(spot);
    }
    const bool is_roof = 10 * open > 6 * patch.size() && 2 * above > patch.size();
    for (const std::size_t spot : patch) spots_[spot].is_roof = is_roof;
  }

  const Scene& scene_;
  const AirLattice& lattice_;
  double headroom_m_ = 0;
  std::vector<FloorSpot> spots_;
  std::vector<std::size_t> columns_;  // first spot of each column
  std::vector<bool> visited_, kept_;
};

}  // namespace

std::vector<FloorSpot> find_floor(const Scene& scene, const AirLattice& lattice) {
  return FloorFinder(scene, lattice).find();
}

}  // namespace clamor
