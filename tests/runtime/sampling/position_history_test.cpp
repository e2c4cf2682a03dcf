#include "runtime/sampling/position_history.h"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/voices/keyframe.h"

namespace clamor {
namespace {

// The distance to the place of emission divided by the speed of sound is the time since.
TEST(PositionHistory, GivesThePlaceOfASourceAtTheTimeOfEmission) {
  constexpr double kSound_mps = 340;
  constexpr std::size_t kSources = 3;
  const auto at_m = [](std::size_t i, double t) -> Vec3 {
    if (i == 0) return {100 * t - 200, 1, 5};                                // a straight line
    if (i == 1) return {20 * std::cos(1.5 * t), 2, 20 * std::sin(1.5 * t)};  // a circle, 30 m/s
    return {t > 3 ? 50.0 : 0.0, 0, 0};                                       // a jump
  };
  PositionHistory history(kSources, kSound_mps);
  std::array<std::vector<float>, 3> now_m;
  for (auto& column : now_m) column.resize(kSources);
  for (int k = 0; k <= 500; ++k) {
    const double t = kKeyframe_s * k;
    for (std::size_t i = 0; i < kSources; ++i)
      for (int axis = 0; axis < 3; ++axis)
        now_m[static_cast<std::size_t>(axis)][i] = static_cast<float>(at_m(i, t)[axis]);
    history.record(t, now_m[0], now_m[1], now_m[2]);
    for (const std::uint32_t i : history.teleported())
      history.restart(i, i == 0 ? Vec3f(100, 0, 0) : Vec3f(0));
    for (const double away_m : {0.5, 3.0, 30.0, 300.0, 1000.0}) {
      const Vec3 place(3, 1.7, away_m);
      for (std::size_t i = 0; i < kSources; ++i) {
        const auto emission = history.emission(i, place);
        const double distance_m = length(place - Vec3(emission.position_m)),
                     left_s = t - distance_m / kSound_mps;
        // The first source moved before it was added, and the third one jumps. The beginning of the
        // second one's path is unknown.
        if (i == 2) {
          ASSERT_EQ(Vec3(emission.position_m), at_m(i, t));
        } else if (i == 0 || left_s > 0.7) {
          const double speed_mps = i == 0 ? 100 : 30;
          // Beyond 3 s only every 16th keyframe is kept, so a curve is slightly off.
          const double slack = away_m > 500 ? 5 : 1;
          ASSERT_LT(length(Vec3(emission.position_m) - at_m(i, left_s)), 0.01 * slack)
              << i << ", " << t << " s, " << away_m << " m";
          ASSERT_NEAR(static_cast<double>(length(emission.velocity_mps)), speed_mps, 0.5 * slack)
              << i << ", " << t << " s, " << away_m << " m";
        }
        ASSERT_LE(
            length(place - at_m(i, t)),
            distance_m * std::sqrt(static_cast<double>(history.max_distance_ratio2()[i])) * 1.0001);
      }
    }
  }
}

}  // namespace
}  // namespace clamor
