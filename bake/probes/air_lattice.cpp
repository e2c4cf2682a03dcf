#include "bake/probes/air_lattice.h"

#include <algorithm>
#include <cmath>

namespace clamor {

namespace {

constexpr double kCell_m = 0.25;                          // passes doors of 0.6 m
constexpr double kLeastCell_m = 1e-6, kLeastCell = 1e-9;  // kLeastCell is a share of coordinates
constexpr double kMaxCells = 4'000'000;
constexpr double kCellsAcross = 16;  // at least, in the longest direction

// Centres lie off round coordinates, so that hardly any lies on a surface.
const Vec3 kShift(0.618033988, 0.414213562, 0.732050807);

double cells_in(const Vec3& size_m, double cell_m) {
  double cells = 1;
  for (int axis = 0; axis < 3; ++axis) cells *= std::floor(size_m[axis] / cell_m) + 1;
  return cells;
}

}  // namespace

bool is_free(const Scene& scene, const Vec3& from_m, const Vec3& to_m) {
  const Vec3 path_m = to_m - from_m;
  const double distance_m = length(path_m);
  if (!(distance_m > 0)) return true;
  const auto hit = scene.intersect(from_m, path_m / distance_m);
  return !hit || hit->distance_m > distance_m;
}

AirLattice::AirLattice(const Scene& scene, const Bounds& bounds) : scene_(scene) {
  set_extent(bounds);
  const auto cells = static_cast<std::size_t>(counts_[0]) * static_cast<std::size_t>(counts_[1]) *
                     static_cast<std::size_t>(counts_[2]);
  links_.assign(cells, 0);
  reached_.assign(cells, 0);
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    LatticeCell cell{};
    for (int i = 0; i < count(u); ++i)
      for (int j = 0; j < count(v); ++j) {
        cell[static_cast<std::size_t>(axis)] = 0;
        cell[static_cast<std::size_t>(u)] = i;
        cell[static_cast<std::size_t>(v)] = j;
        link_row(cell, axis);
      }
  }
}

void AirLattice::set_extent(const Bounds& bounds) {
  const Vec3 size_m = bounds.high_m - bounds.low_m;
  const double longest_m = std::max({size_m.x, size_m.y, size_m.z});
  cell_m_ = longest_m > 0 ? std::min(kCell_m, longest_m / kCellsAcross) : kCell_m;
  // Coordinates in cells must be exact integers.
  for (int axis = 0; axis < 3; ++axis)
    for (const double end_m : {bounds.low_m[axis], bounds.high_m[axis]})
      cell_m_ = std::max({cell_m_, kLeastCell_m, kLeastCell * std::abs(end_m)});
  while (cells_in(size_m, cell_m_) > kMaxCells) cell_m_ *= 1.25;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const double low = bounds.low_m[axis] / cell_m_ - kShift[axis];
    const double high = bounds.high_m[axis] / cell_m_ - kShift[axis];
    first_[a] = static_cast<long long>(std::ceil(low));
    const auto last = std::max(first_[a], static_cast<long long>(std::floor(high)));
    counts_[a] = static_cast<int>(last - first_[a] + 1);
  }
}

Vec3 AirLattice::centre_m(const LatticeCell& cell) const {
  Vec3 centre;
  for (int axis = 0; axis < 3; ++axis)
    centre[axis] =
        (static_cast<double>(world(axis, cell[static_cast<std::size_t>(axis)])) + kShift[axis]) *
        cell_m_;
  return centre;
}

bool AirLattice::contains(const LatticeCell& cell) const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (cell[axis] < 0 || cell[axis] >= counts_[axis]) return false;
  return true;
}

bool AirLattice::is_linked(const LatticeCell& cell, int axis) const {
  return (links_[index_of(cell)] >> axis & 1) != 0;
}

// Each ray starts at the cell behind the surface that the previous one met.
void AirLattice::link_row(LatticeCell cell, int axis) {
  const auto a = static_cast<std::size_t>(axis);
  Vec3 direction(0);
  direction[axis] = 1;
  while (cell[a] + 1 < counts_[a]) {
    const int left = counts_[a] - 1 - cell[a];
    const auto hit = scene_.intersect(centre_m(cell), direction);
    const double steps = hit ? std::floor((hit->distance_m - scene_.offset_m()) / cell_m_) : left;
    const int free = steps >= left ? left : std::max(0, static_cast<int>(steps));
    for (int i = 0; i < free; ++i, ++cell[a])
      links_[index_of(cell)] = static_cast<std::uint8_t>(links_[index_of(cell)] | 1 << axis);
    ++cell[a];
  }
}

std::optional<LatticeCell> AirLattice::visible_cell(const Vec3& place_m, bool clamped) const {
  LatticeCell around{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const double position = place_m[axis] / cell_m_ - kShift[axis] - static_cast<double>(first_[a]);
    if (!clamped && !(position > -1.5 && position < counts_[a] + 0.5)) return std::nullopt;
    around[a] = static_cast<int>(std::clamp(std::round(position), 0.0, counts_[a] - 1.0));
  }
  std::optional<LatticeCell> nearest;
  double nearest_m = 0;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const LatticeCell cell = {around[0] + x, around[1] + y, around[2] + z};
        if (!contains(cell)) continue;
        const double distance_m = length(centre_m(cell) - place_m);
        if (nearest && distance_m >= nearest_m) continue;
        if (!is_free(scene_, place_m, centre_m(cell))) continue;
        nearest = cell;
        nearest_m = distance_m;
      }
  return nearest;
}

void AirLattice::flood(const LatticeCell& from) {
  if (is_reached(from)) return;
  std::vector<LatticeCell> stack = {from};
  reached_[index_of(from)] = 1;
  while (!stack.empty()) {
    const LatticeCell cell = stack.back();
    stack.pop_back();
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        LatticeCell next = cell;
        next[static_cast<std::size_t>(axis)] += step;
        if (!contains(next) || is_reached(next) || !is_linked(step > 0 ? cell : next, axis))
          continue;
        reached_[index_of(next)] = 1;
        stack.push_back(next);
      }
  }
}

}  // namespace clamor
