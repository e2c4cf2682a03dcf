// hemisphere.h: integrates and counts directions above a surface whose normal is +Z.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include "common/vec.h"

namespace clamor::testing {

inline double radians(double degrees) { return degrees * std::numbers::pi / 180; }

inline Vec3 off_normal(double cos_o, double azimuth) {
  const double sin_o = std::sqrt(std::max(0.0, 1 - cos_o * cos_o));
  return {sin_o * std::cos(azimuth), sin_o * std::sin(azimuth), cos_o};
}

// Calls visit(direction, weight) for directions whose weights turn a sum of a density into its
// integral over the hemisphere around +Z. `points` directions follow the cosine law and as many
// each lobe of the given exponents, so all of these are resolved; the weights are those of the
// mixture. The points are Fibonacci spirals, denser towards both ends, where the share of a lobe
// per ring has roots.
template <class Visit>
void over_hemisphere(std::span<const double> exponents, const Vec3& mirror, int points,
                     Visit visit) {
  constexpr double kPi = std::numbers::pi;
  const Basis basis = basis_around(mirror);
  const auto visit_weighted = [&](const Vec3& direction, double share) {
    const double cos_a = dot(direction, mirror), cos_o = direction.z;
    if (cos_o <= 0) return;
    double density = cos_o / kPi;
    if (cos_a > 0)
      for (const double p : exponents) density += (p + 1) / (2 * kPi) * std::pow(cos_a, p);
    visit(direction, share / density);
  };
  for (int i = 0; i < points; ++i) {
    const double x = (i + 0.5) / points, u = x * x * (3 - 2 * x);
    const double share = 6 * x * (1 - x) / points;
    const double phi = std::fmod(i * kPi * (3 - std::sqrt(5)), 2 * kPi);
    visit_weighted(off_normal(std::sqrt(u), phi), share);
    for (const double p : exponents) {
      const double cos_a = std::pow(u, 1 / (p + 1));
      const double sin_a = std::sqrt(1 - cos_a * cos_a);
      visit_weighted(mirror * cos_a + basis.tangent * (sin_a * std::cos(phi)) +
                         basis.bitangent * (sin_a * std::sin(phi)),
                     share);
    }
  }
}

template <class Visit>
void over_hemisphere(double exponent, const Vec3& mirror, int points, Visit visit) {
  over_hemisphere(std::span(&exponent, 1), mirror, points, visit);
}

// Cells by angle to the mirror direction, whose widths double from each to the next, so lobes of
// any exponent fill some; by height; and by side of the plane of incidence, which contains the X
// axis.
class DirectionCells {
 public:
  explicit DirectionCells(const Vec3& mirror) : mirror_(mirror) {}

  static constexpr std::size_t size() { return std::size_t{kAngles} * kHeights * 2; }

  std::size_t of(const Vec3& out) const {
    const double versine = std::max(1 - dot(out, mirror_), 1e-30);  // at most 2
    const int angle =
        std::clamp(kAngles - 1 + static_cast<int>(std::floor(std::log2(versine))), 0, kAngles - 1);
    const int height = std::clamp(static_cast<int>(out.z * out.z * kHeights), 0, kHeights - 1);
    return static_cast<std::size_t>((angle * kHeights + height) * 2 + (out.y > 0 ? 1 : 0));
  }

 private:
  static constexpr int kAngles = 13, kHeights = 8;

  Vec3 mirror_;
};

// Standard deviations by which chi-square exceeds its mean. Cells that expect fewer than 20 draws
// are merged, because the normal approximation fails for them; a draw where none is possible makes
// the result huge.
inline double chi_square_excess(const std::vector<double>& drawn,
                                const std::vector<double>& expected) {
  double chi_square = 0, rest_drawn = 0, rest_expected = 0, cells = 0;
  const auto count = [&](double found, double wanted) {
    chi_square += (found - wanted) * (found - wanted) / wanted;
    ++cells;
  };
  for (std::size_t c = 0; c < drawn.size(); ++c) {
    if (expected[c] >= 20) {
      count(drawn[c], expected[c]);
    } else {
      rest_drawn += drawn[c];
      rest_expected += expected[c];
    }
  }
  if (rest_drawn > 0 || rest_expected > 0) count(rest_drawn, std::max(rest_expected, 1e-3));
  return (chi_square - cells) / std::sqrt(2 * cells);
}

}  // namespace clamor::testing
