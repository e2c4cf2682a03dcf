#include "bake/bake_until.h"

#include <atomic>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/rooms.h"

namespace clamor {
namespace {

using ::testing::HasSubstr;
using testing::shoebox;
using testing::uniform_material;

const Level& room() {
  static const Level level = shoebox({5, 4, 3}, uniform_material(0.3f), {1, 1, 1});
  return level;
}

bool same(const Source& a, const Source& b) {
  return a.position_m == b.position_m && a.power == b.power && a.delay_s == b.delay_s &&
         a.emitter == b.emitter;
}

TEST(BakeGoal, ParsesErrorsAndTimesWithTheirUnits) {
  EXPECT_EQ(BakeGoal::from("0.5dB")->error_db, 0.5);
  EXPECT_EQ(BakeGoal::from("0.5dB")->seconds, 0);
  EXPECT_EQ(BakeGoal::from("0.5db")->error_db, 0.5);
  EXPECT_EQ(BakeGoal::from("90s")->seconds, 90);
  EXPECT_EQ(BakeGoal::from("1.5min")->seconds, 90);
  EXPECT_EQ(BakeGoal::from("2h")->seconds, 7200);
  for (const char* wrong :
       {"", "dB", "0.5", "0dB", "-1dB", "nandB", "infs", "1e9s", "1 dB", "5 db", "3dBs"})
    EXPECT_FALSE(BakeGoal::from(wrong)) << wrong;
}

TEST(BakeUntil, ReachesTheErrorAndEqualsThePlainBakeOfThatSize_NoAsan) {
  BakeOptions options;
  std::string why_not;
  BakeReport report;
  const auto coarse = bake_until(room(), options, {1.5, 0}, &report, &why_not);
  const auto fine = bake_until(room(), options, {0.08, 0}, &report, &why_not);
  ASSERT_TRUE(coarse.ok() && fine.ok());
  EXPECT_EQ(why_not, "");
  EXPECT_GT(fine->statistics.decay.error_db, 0);
  EXPECT_LE(fine->statistics.decay.error_db, 0.08f);
  EXPECT_LT(coarse->octree.sources.size(), fine->octree.sources.size());

  options.settings = fine->settings;
  const auto plain = bake(room(), options);
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(plain->statistics.decay.error_db, fine->statistics.decay.error_db);
  EXPECT_EQ(report.photons, plain->statistics.photons_traced);
  ASSERT_EQ(plain->octree.sources.size(), fine->octree.sources.size());
  for (std::size_t i = 0; i < plain->octree.sources.size(); ++i)
    ASSERT_TRUE(same(plain->octree.sources[i], fine->octree.sources[i])) << i;
}

TEST(BakeUntil, ReturnsABakeEvenWithoutTime) {
  const auto contents = bake_until(room(), {}, {0, 1e-9});
  ASSERT_TRUE(contents.ok());
  EXPECT_GT(contents->octree.sources.size(), 1000u);
}

TEST(BakeUntil, GrowsQuicklyWithMuchTimeLeft) {
  std::atomic<bool> stop = false;
  std::uint64_t first = 0, second = 0;
  BakeOptions options;
  options.stop = &stop;
  options.on_progress = [&](const BakeProgress& progress) {
    if (first == 0) first = progress.photons_total;
    if (progress.photons_total == first) return;
    second = progress.photons_total;
    stop = true;
  };
  EXPECT_FALSE(bake_until(room(), options, {0, 1e5}).ok());
  EXPECT_EQ(second, 32 * first);
}

TEST(BakeUntil, ReturnsTheBestBakeWithinTheMemoryLimitAndExplains) {
  BakeOptions options;
  options.memory_bytes = 130'000'000;
  std::string why_not;
  const auto contents = bake_until(room(), options, {0.05, 0}, nullptr, &why_not);
  ASSERT_TRUE(contents.ok());
  EXPECT_THAT(why_not, HasSubstr("of memory"));
  EXPECT_GT(contents->octree.sources.size(), 1000u);
}

TEST(BakeUntil, ExplainsIfTheLevelHasNoErrorEstimate) {
  Level level = room();
  level.materials[0] = uniform_material(1);
  std::string why_not;
  const auto contents = bake_until(level, {}, {1, 0}, nullptr, &why_not);
  ASSERT_TRUE(contents.ok());
  EXPECT_THAT(why_not, HasSubstr("too dry"));
}

TEST(BakeUntil, FinishesImmediatelyInAFreeField) {
  Level level = room();
  level.mesh = {};
  std::string why_not;
  const auto contents = bake_until(level, {}, {1, 0}, nullptr, &why_not);
  ASSERT_TRUE(contents.ok());
  EXPECT_EQ(why_not, "");
  EXPECT_EQ(contents->octree.sources.size(), 1u);
}

TEST(BakeUntil, StopsOnRequest) {
  std::atomic<bool> stop = false;
  int rounds = 0;
  BakeOptions options;
  options.stop = &stop;
  options.on_progress = [&](const BakeProgress& progress) {
    if (std::string_view(progress.stage) == "sorting") stop = ++rounds == 2;
  };
  const auto contents = bake_until(room(), options, {0.05, 0});
  EXPECT_FALSE(contents.ok());
  EXPECT_EQ(rounds, 2);
}

}  // namespace
}  // namespace clamor
