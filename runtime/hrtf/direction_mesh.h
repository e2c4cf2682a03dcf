// direction_mesh.h: a spherical triangulation of directions, with point location.
//
// The triangulation is the convex hull, built incrementally: faces visible from a new direction are
// removed, and the hole is closed with triangles to it. Measured directions often lie on common
// circles, so each is first moved by some 1e-7, depending on its index only; no decision is then
// left to rounding. Point location walks from a nearby triangle across the edges that the direction
// lies outside of. It starts at the triangle of a grid cell, or for a moving direction at the last
// result.
//
// Threads: find() on any. Memory: some 30 kB plus 130 bytes per direction. Cost: a few triangles
// per search, 9 multiply-adds each.
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
  // `directions` are distinct unit vectors. find() must not be called if depth() is 0.
  explicit DirectionMesh(std::span<const Vec3f> directions);

  // Distance from the centre to the nearest triangle's plane: the cosine of half the widest gap. 0
  // if the gap is half a sphere or more, so that there is no triangulation.
  double depth() const { return depth_; }

  struct Place {
    std::array<std::uint32_t, 3> corner;  // indices of directions
    std::array<float, 3> share;           // barycentric weights: not negative, with sum 1
  };
  Place find(const Vec3f& direction) const noexcept REALTIME;

  // Starts at the triangle of the last result, `last`, which is 0 at first.
  Place find(const Vec3f& direction, std::uint32_t& last) const noexcept REALTIME;

 private:
  // Matrix from a direction to its barycentric weights, column by column so that four floats can be
  // loaded at once.
  struct alignas(64) Triangle {
    std::array<float, 3 * 3 + 1> share{};
    std::array<std::uint32_t, 3> corner{};
    std::array<std::uint32_t, 3> across{};  // the neighbour beyond the edge opposite each corner
  };
  using Shares = std::array<float, 4>;  // of three corners
  static constexpr int kCells = 24;     // along each edge of a cube's face

  static std::size_t cell_of(const Vec3f& direction) noexcept REALTIME;
  static Shares shares_of(const Triangle& triangle, const Vec3f& direction) noexcept REALTIME;
  static Place place_in(const Triangle& triangle, const Shares& shares) noexcept REALTIME;

  // Walks until the direction lies inside, at most `most` steps. Returns whether it does.
  bool walk(const Vec3f& direction, int most, std::uint32_t& triangle,
            Shares& shares) const noexcept REALTIME;

  double depth_ = 0;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> near_;  // by cell: the triangle at its middle
};

}  // namespace clamor
