// direction_mesh.h: triangles between directions on a sphere, and which of them one lies in.
//
// The convex hull of the directions, built one at a time: those faces that a new one sees are taken
// away and the hole is closed with triangles to it. Directions on one circle, as measurements are,
// are moved by some 1e-7 for that, by their number, so that every choice is made and none is left
// to rounding. A search walks from a triangle near by across the edge that it is outside of: that
// of a cell of a grid, or for a direction that turns, the one where it was.
//
// Threads: find() on any. Memory: some 30 kB and 130 bytes a direction. Cost: a few triangles a
// search, 9 multiply-adds each.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/vec.h"
#include "runtime/realtime/realtime.h"

namespace clamor {

class DirectionMesh {
 public:
  // Unit vectors, no two of them the same. Nothing can be found if their depth() is 0.
  explicit DirectionMesh(std::span<const Vec3f> directions);

  // How far the sphere's middle lies inside of all triangles: the cosine of half the widest gap. 0
  // where that is half a sphere or more, so that there is nothing between which to look.
  double depth() const { return depth_; }

  struct Place {
    std::array<std::uint32_t, 3> corner;  // numbers of directions
    std::array<float, 3> share;           // not negative, and their sum is 1
  };
  Place find(const Vec3f& direction) const noexcept REALTIME;

  // Looks first in the triangle that was found last, at first 0, and round it.
  Place find(const Vec3f& direction, std::uint32_t& last) const noexcept REALTIME;

 private:
  // A direction's products with x, y and z of its corners' shares: these lie one after the other,
  // so that four floats can be read of each.
  struct alignas(64) Triangle {
    std::array<float, 3 * 3 + 1> share{};
    std::array<std::uint32_t, 3> corner{};
    std::array<std::uint32_t, 3> across{};  // the triangle beyond the edge opposite of a corner
  };
  using Shares = std::array<float, 4>;  // of three corners
  static constexpr int kCells = 24;     // along each edge of a cube's faces

  static std::size_t cell_of(const Vec3f& direction) noexcept REALTIME;
  static Shares shares_of(const Triangle& triangle, const Vec3f& direction) noexcept REALTIME;
  static Place place_in(const Triangle& triangle, const Shares& shares) noexcept REALTIME;

  // Goes on until the direction is inside, but no more than so many steps. True if it is.
  bool walk(const Vec3f& direction, int most, std::uint32_t& triangle,
            Shares& shares) const noexcept REALTIME;

  double depth_ = 0;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> near_;  // by cell: the triangle at its middle
};

}  // namespace clamor
