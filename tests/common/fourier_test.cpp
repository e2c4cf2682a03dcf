#include "common/fourier.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "common/random.h"

namespace clamor {
namespace {

std::vector<std::complex<double>> noise(std::size_t size) {
  std::vector<std::complex<double>> values(size);
  for (std::size_t i = 0; i < size; ++i) {
    const RandomBits bits = philox(1, {static_cast<std::uint32_t>(i), 0, 0, 0});
    values[i] = {unit(bits[0]) - 0.5, unit(bits[1]) - 0.5};
  }
  return values;
}

TEST(Fourier, MatchesItsDefinition) {
  for (const std::size_t size : {1u, 2u, 4u, 64u, 256u}) {
    const auto x = noise(size);
    auto transformed = x;
    Fourier(size).forward(transformed);
    for (std::size_t k = 0; k < size; ++k) {
      std::complex<double> sum = 0;
      for (std::size_t n = 0; n < size; ++n)
        sum += x[n] * std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(k * n % size) /
                                          static_cast<double>(size));
      EXPECT_NEAR(std::abs(transformed[k] - sum), 0, 1e-12) << k << " of " << size;
    }
  }
}

TEST(Fourier, IsInvertible) {
  const auto x = noise(8192);
  auto there_and_back = x;
  const Fourier fourier(x.size());
  fourier.forward(there_and_back);
  fourier.inverse(there_and_back);
  for (std::size_t i = 0; i < x.size(); ++i)
    ASSERT_NEAR(std::abs(there_and_back[i] - x[i]), 0, 1e-13) << i;
}

}  // namespace
}  // namespace clamor
