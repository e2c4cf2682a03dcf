// air_lattice.h: a lattice of air cells over a level, and which of them are connected.
//
// Two neighbours are linked if the segment between their centres meets no surface. One ray along a
// row of cells finds all links up to the next surface, so that the number of rays grows with the
// surfaces and not with the volume. The lattice is anchored to world coordinates; its cell size
// depends on the level's bounds alone.
//
// Openings narrower than a cell may be missed: in levels above 60 000 m3 cells exceed a quarter of
// a metre, and a door is found for certain only if an emitter or a hand-placed probe is behind it.
//
// Threads: const functions may be called concurrently. Memory: two bytes per cell, at most 8 MB.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "bake/trace/scene.h"
#include "common/bounds.h"
#include "common/vec.h"

namespace clamor {

// Integer coordinates, counted from the lattice's lowest corner.
using LatticeCell = std::array<int, 3>;

class AirLattice {
 public:
  // Covers `bounds` with cells of a quarter of a metre, larger ones in large levels and smaller
  // ones in tiny levels.
  AirLattice(const Scene& scene, const Bounds& bounds);

  double cell_m() const { return cell_m_; }
  int count(int axis) const { return counts_[static_cast<std::size_t>(axis)]; }
  Vec3 centre_m(const LatticeCell& cell) const;

  // World coordinates in cells: the same for all lattices of this cell size.
  long long world(int axis, int position) const {
    return first_[static_cast<std::size_t>(axis)] + position;
  }

  // Returns whether the cell is linked to its neighbour one step up along the axis.
  bool is_linked(const LatticeCell& cell, int axis) const;
  bool is_reached(const LatticeCell& cell) const { return reached_[index_of(cell)]; }

  // The nearest cell whose centre is visible from the point, among those around it. With `clamped`,
  // points outside the lattice are moved to its border first.
  std::optional<LatticeCell> visible_cell(const Vec3& place_m, bool clamped) const;

  // Reaches all cells that are connected to this one.
  void flood(const LatticeCell& from);

 private:
  std::size_t index_of(const LatticeCell& cell) const {
    return (static_cast<std::size_t>(cell[0]) * static_cast<std::size_t>(counts_[1]) +
            static_cast<std::size_t>(cell[1])) *
               static_cast<std::size_t>(counts_[2]) +
           static_cast<std::size_t>(cell[2]);
  }
  bool contains(const LatticeCell& cell) const;
  void set_extent(const Bounds& bounds);
  void link_row(LatticeCell cell, int axis);

  const Scene& scene_;
  double cell_m_ = 0;
  std::array<long long, 3> first_{};
  std::array<int, 3> counts_{};
  std::vector<std::uint8_t> links_;  // one bit per axis
  std::vector<std::uint8_t> reached_;
};

// Returns whether the segment between two points meets no surface, transmitting or not.
bool is_free(const Scene& scene, const Vec3& from_m, const Vec3& to_m);

}  // namespace clamor
