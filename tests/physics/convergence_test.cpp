// The estimator is unbiased: its error falls with the number of photons and has no floor.
#include <array>
#include <cmath>
#include <cstdint>
#include <iostream>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "runtime/propagation/received_intensity.h"
#include "tests/rooms.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

// Reflected intensity at one place of a dry room with Lambertian walls in the steady state,
// relative to the source at 1 m: `python3 tests/physics/reference.py listener dry`, standard error
// 0.03 %.
constexpr double kReference = 0.284705;

double reflected_intensity(std::uint64_t photons, std::uint64_t seed) {
  Level level = testing::shoebox({6, 5, 3}, {}, {2, 3, 1.2});
  level.mesh = testing::box({6, 5, 3}, {0, 1, 2, 3, 4, 5});
  level.materials.clear();
  for (const float absorption : {0.4f, 0.5f, 0.3f, 0.5f, 0.6f, 0.7f})
    level.materials.push_back(testing::uniform_material(absorption));
  BakeSettings settings{.seed = seed, .photons = photons, .sources = 10'000'000};
  settings.roulette_exponent = 0.5;
  const auto contents = bake(level, {.settings = settings, .threads = 1});
  const ReflectionLaws laws(level.materials);
  double heard = 0;
  for (const Source& source : contents->octree.sources)
    if (!source.is_emitter)
      heard += static_cast<double>(
          received_intensity(source, level.emitters, laws, {}, Vec3(4.2, 1.3, 1.6))[0]);
  return heard;
}

// Photons per bake, from 20 to 20 000, and the number of seeds.
struct Step {
  std::uint64_t photons;
  int seeds;
};
constexpr std::array<Step, 7> kSteps = {
    {{20, 64}, {63, 48}, {200, 32}, {632, 24}, {2000, 16}, {6325, 10}, {20000, 8}}};

TEST(Convergence, ErrorFallsWithTheSquareRootOfThePhotonsOverThreeDecades) {
  if (testing::kSanitized) GTEST_SKIP() << "a minute of numbers, which a sanitizer does not judge";
  double weights = 0, x_sum = 0, y_sum = 0, xx_sum = 0, xy_sum = 0;
  for (const Step& step : kSteps) {
    double squares = 0, sum = 0;
    for (int seed = 1; seed <= step.seeds; ++seed) {
      const double error =
          reflected_intensity(step.photons, 100 * step.photons + static_cast<std::uint64_t>(seed)) /
              kReference -
          1;
      squares += error * error / step.seeds;
      sum += error / step.seeds;
    }
    // The mean error is noise for every number of photons, so there is no bias.
    EXPECT_LT(std::abs(sum), 4 * std::sqrt(squares / step.seeds)) << step.photons << " photons";
    std::cout << step.photons << " photons: rms error " << 100 * std::sqrt(squares)
              << " %, mean error " << 100 * sum << " % of " << step.seeds << " seeds\n";
    const double x = std::log10(step.photons), y = std::log10(squares) / 2, weight = step.seeds;
    weights += weight, x_sum += weight * x, y_sum += weight * y;
    xx_sum += weight * x * x, xy_sum += weight * x * y;
  }
  const double slope = (weights * xy_sum - x_sum * y_sum) / (weights * xx_sum - x_sum * x_sum);
  // The logarithm of the rms of n values has a standard deviation of 0.31 / sqrt(n), which gives
  // that of the slope.
  const double slope_error = 0.31 / std::sqrt(xx_sum - x_sum * x_sum / weights);
  const double factor = std::pow(10, (y_sum - slope * x_sum) / weights);
  std::cout << "fit: rms error = " << 100 * factor << " % x photons^" << slope << " (+- "
            << slope_error << ")\n";
  RecordProperty("slope", std::to_string(slope));
  EXPECT_LT(slope_error, 0.035);
  // A bias would flatten the fit. Sobol points steepen it, because their error falls faster in the
  // first two orders. (With random numbers the error was twice as large and the slope -0.52.)
  EXPECT_LT(slope, -0.5 + 3 * slope_error);
  EXPECT_GT(slope, -0.6 - 3 * slope_error);
}

}  // namespace
}  // namespace clamor
