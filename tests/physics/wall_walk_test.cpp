// Close to a wall a source is a patch, not a point: no single source stands out.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/air.h"
#include "runtime/propagation/received_intensity.h"
#include "tests/rooms.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

// Whether sources have a radius, within which their intensity stays constant.
enum class WallSources { kPatches, kPoints };

// Levels at places 5 cm in front of the wall y = 0, for all bands together and at 500 Hz.
std::vector<double> levels_along_the_wall_db(const BakeContents& contents,
                                             WallSources as = WallSources::kPatches) {
  const ReflectionLaws laws(contents.materials);
  const Bands air = air_loss_per_m(contents.settings.air);
  std::vector<double> levels_db;
  for (int step = 0; step <= 20; ++step) {
    const Vec3 listener_m(0.5 + 0.2 * step, 0.05, 1.1);
    double all = 0, middle = 0;
    for (const Source& source : contents.octree.sources) {
      const Bands intensity = received_intensity(source, contents.emitters, laws, air, listener_m);
      const double r_m = length(listener_m - Vec3(source.position_m));
      const double times = as == WallSources::kPoints
                               ? std::pow(std::max(1.0, source_radius_m(source) / r_m), 2)
                               : 1;
      for (const float band : intensity) all += times * static_cast<double>(band);
      middle += times * static_cast<double>(intensity[3]);
    }
    levels_db.push_back(10 * std::log10(all));
    levels_db.push_back(10 * std::log10(middle));
  }
  return levels_db;
}

// Root mean square and maximum of the differences of levels.
struct WallDifference {
  double rms_db = 0, worst_db = 0;
};

WallDifference wall_difference(const std::vector<double>& levels_db,
                               const std::vector<double>& others_db) {
  double squares = 0, worst_db = 0;
  for (std::size_t i = 0; i < levels_db.size(); ++i) {
    const double off_db = std::abs(levels_db[i] - others_db[i]);
    squares += off_db * off_db / static_cast<double>(levels_db.size());
    worst_db = std::max(worst_db, off_db);
  }
  return {std::sqrt(squares), worst_db};
}

// One seed decides which place is worst: by more than 1 dB with four seeds of ten, by 1.3 at most.
// The root mean square is 0.38 dB with a standard deviation of 0.035 over seeds; a quarter of its
// square is the noise of the larger bake.
TEST(WalkAlongAWall, StaysWithinHalfADecibelRmsOfABakeWithSixteenTimesThePhotons) {
  if (testing::kSanitized) GTEST_SKIP() << "only numbers, which a sanitizer does not judge";
  constexpr std::uint64_t kPhotons = 8000, kSeeds = 4;
  const Level level =
      testing::shoebox({5, 4, 3}, testing::uniform_material(0.2f, 0.3f, 20), {1.3, 1.7, 1.1});
  const auto many = bake(level, {.settings = {.seed = 100, .photons = 16 * kPhotons}});
  ASSERT_TRUE(many.ok());
  const auto many_db = levels_along_the_wall_db(*many);
  double squares = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto few = bake(level, {.settings = {.seed = seed, .photons = kPhotons}});
    ASSERT_TRUE(few.ok());
    const WallDifference off = wall_difference(levels_along_the_wall_db(*few), many_db);
    squares += off.rms_db * off.rms_db / kSeeds;
    EXPECT_LT(off.worst_db, 2) << "seed " << seed;
    if (seed > 1) continue;
    const WallDifference of_points =
        wall_difference(levels_along_the_wall_db(*few, WallSources::kPoints), many_db);
    RecordProperty("points_rms_db", std::to_string(of_points.rms_db));
    EXPECT_GT(of_points.rms_db, 0.55) << "the test would not notice sources without a radius";
  }
  RecordProperty("rms_db", std::to_string(std::sqrt(squares)));
  EXPECT_LT(std::sqrt(squares), 0.46);
}

}  // namespace
}  // namespace clamor
