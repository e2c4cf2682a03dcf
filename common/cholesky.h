// cholesky.h: solver for symmetric positive definite systems.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace clamor {

// Solves a x = b in place by Cholesky factorisation: b becomes x, and the lower triangle of a, the
// only one read, becomes its factor. Row j is zero left of first[j].
template <std::size_t kSize>
void solve_positive_definite(std::array<std::array<double, kSize>, kSize>& a,
                             std::array<double, kSize>& b,
                             const std::array<std::size_t, kSize>& first = {}) {
  for (std::size_t j = 0; j < kSize; ++j) {
    for (std::size_t k = first[j]; k <= j; ++k) {
      double sum = a[j][k];
      for (std::size_t i = std::max(first[j], first[k]); i < k; ++i) sum -= a[j][i] * a[k][i];
      a[j][k] = k == j ? std::sqrt(sum) : sum / a[k][k];
    }
    for (std::size_t i = first[j]; i < j; ++i) b[j] -= a[j][i] * b[i];
    b[j] /= a[j][j];
  }
  for (std::size_t j = kSize; j-- > 0;) {
    b[j] /= a[j][j];
    for (std::size_t i = first[j]; i < j; ++i) b[i] -= a[j][i] * b[j];
  }
}

}  // namespace clamor
