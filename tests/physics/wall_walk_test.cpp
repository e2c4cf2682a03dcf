// Close to a wall a source is a patch, not a point: no single source stands out.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/air.h"
#include "runtime/propagation/received_intensity.h"
#include "tests/rooms.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

// Levels at places 5 cm in front of the wall y = 0, for all bands together and at 500 Hz.
std::vector<double> levels_along_the_wall_db(const BakeContents& contents) {
  const ReflectionLaws laws(contents.materials);
  const Bands air = air_loss_per_m(contents.settings.air);
  std::vector<double> levels_db;
  for (int step = 0; step <= 40; ++step) {
    const Vec3 listener_m(0.5 + 0.1 * step, 0.05, 1.1);
    double all = 0, middle = 0;
    for (const Source& source : contents.octree.sources) {
      const Bands intensity = received_intensity(source, contents.emitters, laws, air, listener_m);
      for (const float band : intensity) all += static_cast<double>(band);
      middle += static_cast<double>(intensity[3]);
    }
    levels_db.push_back(10 * std::log10(all));
    levels_db.push_back(10 * std::log10(middle));
  }
  return levels_db;
}

TEST(WalkAlongAWall, StaysWithinOneDecibelOfABakeWithSixteenTimesThePhotons) {
  if (testing::kSanitized) GTEST_SKIP() << "only numbers, which a sanitizer does not judge";
  const Level level =
      testing::shoebox({5, 4, 3}, testing::uniform_material(0.2f, 0.3f, 20), {1.3, 1.7, 1.1});
  const auto few = bake(level, {.settings = {.photons = 8000}});
  const auto many = bake(level, {.settings = {.seed = 2, .photons = 16 * 8000}});
  ASSERT_TRUE(few.ok() && many.ok());
  const auto few_db = levels_along_the_wall_db(*few), many_db = levels_along_the_wall_db(*many);
  double squares = 0;
  for (std::size_t i = 0; i < few_db.size(); ++i) {
    EXPECT_NEAR(few_db[i], many_db[i], 1) << "place " << i / 2;
    squares += std::pow(few_db[i] - many_db[i], 2);
  }
  RecordProperty("rms_db", std::to_string(std::sqrt(squares / static_cast<double>(few_db.size()))));
}

}  // namespace
}  // namespace clamor
