#include "bake/absorption_fit.h"

#include <cmath>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

Level room(float absorption) {
  return testing::shoebox({5, 4, 3}, testing::uniform_material(absorption), {1.3, 1.7, 1.1});
}

BakeOptions options(std::uint64_t seed) {
  BakeOptions options;
  options.settings.seed = seed;
  options.settings.photons = 4096;
  options.settings.sources = 40'000;
  return options;
}

// In two octaves, which air hardly tells apart.
MeasuredDecay measured(double t30_s) {
  MeasuredDecay decay;
  decay.times_s[2] = decay.times_s[4] = t30_s;
  return decay;
}

TEST(AbsorptionFit, ReturnsTheAbsorptionOfWhichTheTimesWereBaked) {
  constexpr double kTrue = 0.2;
  const auto baked = bake(room(kTrue), options(7));
  ASSERT_TRUE(baked.ok()) << baked.error().message;
  const DecaySummary& decay = baked->statistics.decay;
  for (const float start : {0.12f, 0.3f}) {
    const auto fit = fit_absorption(room(start), options(1), measured(decay.t30_s[4]));
    ASSERT_TRUE(fit.ok()) << fit.error().message;
    ASSERT_EQ(fit->surfaces.size(), 1u);
    const AbsorptionFit::Surface& walls = fit->surfaces[0];
    EXPECT_NEAR(walls.area_m2, 94, 1e-3);
    for (const std::size_t b : {2u, 4u}) {
      ASSERT_TRUE(fit->octaves[b].has_value());
      const AbsorptionFit::Octave& octave = *fit->octaves[b];
      EXPECT_NEAR(octave.after_s / octave.measured_s, 1, 0.01);
      // Four standard errors of both times, in absorption, and their rounding to milliseconds.
      const double error_s =
          std::hypot(octave.error_s, static_cast<double>(decay.t30_error_s[b])) + 0.001;
      EXPECT_LT(error_s, 0.03 * octave.measured_s);
      EXPECT_NEAR(walls.after[b], kTrue, 4 * error_s / std::abs(walls.slope_s[b]));
      // Eyring: the time is inverse to -ln(1 - a). Unequal path lengths change that by some
      // per cent.
      const double eyring_s = -octave.after_s / ((1 - kTrue) * -std::log1p(-kTrue));
      EXPECT_NEAR(walls.slope_s[b] / eyring_s, 1, 0.08);
    }
    EXPECT_FALSE(fit->octaves[3].has_value());
    EXPECT_EQ(walls.after[3], start);
  }
}

// A surface in two materials of one absorption is fitted as one.
TEST(AbsorptionFit, DoesNotDependOnHowASurfaceIsDivided) {
  const auto decays = measured(0.5);
  const auto whole = fit_absorption(room(0.15f), options(1), decays);
  Level divided = room(0.15f);
  divided.materials.push_back(divided.materials[0]);
  divided.materials[1].name = "ends";
  divided.mesh = testing::box({5, 4, 3}, {1, 1, 0, 0, 0, 0});
  const auto parts = fit_absorption(divided, options(1), decays);
  ASSERT_TRUE(whole.ok() && parts.ok());
  ASSERT_EQ(parts->surfaces.size(), 2u);
  EXPECT_EQ(parts->surfaces[1].name, "ends");
  for (const AbsorptionFit::Surface& part : parts->surfaces)
    // The paths meet the ends a little more or less often than their area says.
    EXPECT_NEAR(part.after[4] / whole->surfaces[0].after[4], 1, 0.02);
}

// A sidecar tells materials by their names, so what it said of one would change the other.
TEST(AbsorptionFit, LeavesDifferentMaterialsOfOneNameAsTheyAre) {
  Level level = room(0.15f);
  level.materials.push_back(level.materials[0]);
  level.materials.push_back(testing::uniform_material(0.3f));
  level.materials[1].name = "ends";
  level.materials[2].name = level.materials[0].name;
  level.mesh = testing::box({5, 4, 3}, {1, 1, 2, 0, 0, 0});
  const auto fit = fit_absorption(level, options(1), measured(0.5));
  ASSERT_TRUE(fit.ok()) << fit.error().message;
  ASSERT_EQ(fit->surfaces.size(), 1u);
  EXPECT_EQ(fit->surfaces[0].name, "ends");
}

TEST(AbsorptionFit, StaysWithinItsBoundsAndRefusesTimesBeyondThem) {
  const AbsorptionRange hard = AbsorptionRange::of(0.02), soft = AbsorptionRange::of(0.95);
  EXPECT_EQ(hard.least, kLeastAbsorption);
  EXPECT_NEAR(hard.most, 0.02 + 3 * (0.03 + 0.2 * 0.02), 1e-12);
  EXPECT_NEAR(soft.least, 0.95 - 3 * (0.03 + 0.2 * 0.95), 1e-12);
  EXPECT_EQ(soft.most, kMostAbsorption);
  EXPECT_EQ(AbsorptionRange::of(0.006).least, 0.006);
  for (const auto& [time_s, says] : {std::pair(12.0, "at their least"), {0.1, "at their most"}}) {
    const auto fit = fit_absorption(room(0.2f), options(1), measured(time_s));
    ASSERT_FALSE(fit.ok());
    EXPECT_NE(fit.error().message.find("at 250 Hz no absorption within its bounds"),
              std::string::npos)
        << fit.error().message;
    EXPECT_NE(fit.error().message.find(says), std::string::npos) << fit.error().message;
  }
  // What only a floor of seats explains is told.
  Level hall = testing::shoebox({15, 12, 6}, testing::uniform_material(0.05f), {4, 5, 1.5});
  hall.materials.push_back(hall.materials[0]);
  hall.materials[1].name = "parquet";
  hall.mesh = testing::box({15, 12, 6}, {0, 0, 0, 0, 1, 0});
  const auto fit = fit_absorption(hall, options(1), measured(0.8));
  ASSERT_FALSE(fit.ok());
  EXPECT_NE(fit.error().message.find("If 'parquet' (180 m2) were a seating area"),
            std::string::npos)
      << fit.error().message;
  // Nothing can be told of surfaces that absorb all.
  EXPECT_FALSE(fit_absorption(room(1), options(1), measured(0.5)).ok());
}

}  // namespace
}  // namespace clamor
