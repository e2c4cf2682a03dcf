// boundary_elements.h: what solutions for thin rigid screens by boundary elements share.
#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace clamor::testing {

using Complex = std::complex<double>;
inline constexpr double kPi = std::numbers::pi, kSound_mps = 343.2;

// Solves a x = b by elimination with pivots; `a` has rows of b.size() numbers.
inline std::vector<Complex> solve(std::vector<Complex> a, std::vector<Complex> b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < n; ++i)
      if (std::norm(a[i * n + k]) > std::norm(a[pivot * n + k])) pivot = i;
    std::swap(b[k], b[pivot]);
    for (std::size_t j = k; j < n; ++j) std::swap(a[k * n + j], a[pivot * n + j]);
    for (std::size_t i = k + 1; i < n; ++i) {
      const Complex factor = a[i * n + k] / a[k * n + k];
      for (std::size_t j = k + 1; j < n; ++j) a[i * n + j] -= factor * a[k * n + j];
      b[i] -= factor * b[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) b[k] -= a[k * n + j] * b[j];
    b[k] /= a[k * n + k];
  }
  return b;
}

struct Element {
  double y, z, width, height;
};

// Divides a rectangle into elements that become narrower towards its border.
inline std::vector<Element> elements(double width_m, double height_m, double wave_m) {
  const auto middles_and_widths = [&](double extent_m) {
    const int count = 6 + static_cast<int>(std::ceil(extent_m / (wave_m / 6)));
    std::vector<std::pair<double, double>> made;
    for (int i = 0; i < count; ++i) {
      const double low = -std::cos(kPi * i / count), high = -std::cos(kPi * (i + 1) / count);
      made.emplace_back((low + high) * extent_m / 4, (high - low) * extent_m / 2);
    }
    return made;
  };
  std::vector<Element> made;
  for (const auto& [y, width] : middles_and_widths(width_m))
    for (const auto& [z, height] : middles_and_widths(height_m))
      made.push_back({y, z, width, height});
  return made;
}

// The integral of 1 / R over an element, R from a point in its plane.
inline double integral_of_inverse(const Element& e, double y, double z) {
  const auto primitive = [](double u, double v) {
    const double r = std::hypot(u, v);
    return u * std::log(v + r) + v * std::log(u + r);
  };
  const double u0 = e.y - y - e.width / 2, u1 = u0 + e.width;
  const double v0 = e.z - z - e.height / 2, v1 = v0 + e.height;
  return primitive(u1, v1) - primitive(u0, v1) - primitive(u1, v0) + primitive(u0, v0);
}

}  // namespace clamor::testing
