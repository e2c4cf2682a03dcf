#include "runtime/voices/lane_fourier.h"

#include <cmath>
#include <complex>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "common/fourier.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {
namespace {

struct alignas(64) Points {
  float at[2048 * 8] = {};
};

TEST(LaneFourier, EqualsATransformInDoublePrecisionInEveryLaneOnEveryInstructionSet) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto real = std::make_unique<Points>(), imaginary = std::make_unique<Points>();
  for (const std::string& target : mix_kernel_targets()) {
    force_mix_kernel(target);
    for (const std::size_t lanes : {4, 8})
      for (std::size_t size = 1; size <= 2048; size *= 2) {
        const LaneFourier fourier(size, lanes);
        std::vector<std::vector<std::complex<double>>> expected(lanes);
        for (std::size_t lane = 0; lane < lanes; ++lane)
          for (std::size_t k = 0; k < size; ++k) {
            const std::complex<float> x(uniform(random), uniform(random));
            real->at[k * lanes + lane] = x.real();
            imaginary->at[k * lanes + lane] = x.imag();
            expected[lane].emplace_back(x);
          }
        const auto given = expected;
        for (auto& values : expected) Fourier(size).forward(values);
        fourier.forward(real->at, imaginary->at);
        const auto point = [&](std::size_t k, std::size_t lane) {
          return std::complex<double>(static_cast<double>(real->at[k * lanes + lane]),
                                      static_cast<double>(imaginary->at[k * lanes + lane]));
        };
        for (std::size_t lane = 0; lane < lanes; ++lane)
          for (std::size_t k = 0; k < size; ++k)
            ASSERT_LT(std::abs(point(k, lane) - expected[lane][fourier.bin(k)]), 1e-4)
                << target << ' ' << size;
        fourier.inverse(real->at, imaginary->at);
        for (std::size_t lane = 0; lane < lanes; ++lane)
          for (std::size_t k = 0; k < size; ++k)
            ASSERT_LT(std::abs(point(k, lane) / static_cast<double>(size) - given[lane][k]), 2e-6)
                << target << ' ' << size;
      }
  }
  force_mix_kernel("");
}

TEST(LaneFourier, NeedsNoZerosInASecondHalfThatIsZero) {
  for (const std::size_t lanes : {4, 8})
    for (std::size_t size = 4; size <= 2048; size *= 2) {
      const LaneFourier fourier(size, lanes);
      const auto whole = std::make_unique<Points>(), whole_imaginary = std::make_unique<Points>();
      for (std::size_t i = 0; i < size / 2 * lanes; ++i) {
        whole->at[i] = std::sin(static_cast<float>(i));
        whole_imaginary->at[i] = std::cos(3 * static_cast<float>(i));
      }
      const auto half = std::make_unique<Points>(*whole),
                 half_imaginary = std::make_unique<Points>(*whole_imaginary);
      for (std::size_t i = size / 2 * lanes; i < size * lanes; ++i)
        half->at[i] = half_imaginary->at[i] = 1e6f;
      fourier.forward(whole->at, whole_imaginary->at);
      fourier.forward_of_half(half->at, half_imaginary->at);
      for (std::size_t i = 0; i < size * lanes; ++i) {
        ASSERT_NEAR(half->at[i], whole->at[i], 1e-3) << size;
        ASSERT_NEAR(half_imaginary->at[i], whole_imaginary->at[i], 1e-3) << size;
      }
    }
}

}  // namespace
}  // namespace clamor
