#include "bake/bake.h"

#include <string>

#include <gtest/gtest.h>

#include "tests/rooms.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::shoebox;
using testing::uniform_material;

Level two_emitters() {
  Level level = shoebox({5, 4, 3}, uniform_material(0.2f, 0.3f, 20), {1.3, 1.7, 1.1});
  level.emitters.push_back(level.emitters[0]);
  level.emitters[1].name = "second";
  level.emitters[1].position_m = {4, 1, 2};
  level.emitters[1].directivity = {0, 0, 1, 1, 2, 2, 4, 4};
  return level;
}

std::string bytes_of_bake(const Level& level, std::uint64_t seed, int threads) {
  const testing::TemporaryFile file(".clamor");
  const auto contents =
      bake(level, {.settings = {.seed = seed, .photons = 3000}, .threads = threads});
  EXPECT_TRUE(contents.ok());
  testing::write(*contents, file, threads);
  return file.bytes();
}

TEST(Bake, HasTheSameBytesOnAnyNumberOfThreads_NoAsan) {
  const std::string one = bytes_of_bake(two_emitters(), 1, 1);
  EXPECT_GT(one.size(), 10000u);
  for (const int threads : {2, 3, 7, 16})
    EXPECT_TRUE(one == bytes_of_bake(two_emitters(), 1, threads)) << threads << " threads";
}

TEST(Bake, DiffersWithTheSeed_NoAsan) {
  EXPECT_FALSE(bytes_of_bake(two_emitters(), 1, 2) == bytes_of_bake(two_emitters(), 2, 2));
}

TEST(Bake, ContainsEveryEmitterAndItsReflections) {
  const auto contents = bake(two_emitters(), {.settings = {.photons = 1000}});
  ASSERT_TRUE(contents.ok());
  std::size_t emitters = 0;
  for (const Source& source : contents->octree.sources) emitters += source.is_emitter;
  EXPECT_EQ(emitters, 2u);
  EXPECT_EQ(contents->octree.sources.size(), 2 + contents->statistics.deposits);
  EXPECT_EQ(contents->statistics.photons_traced, 1000u);
}

TEST(Bake, KeepsMovablePartsAndDoesNotTraceThem) {
  Level with_door = two_emitters();
  with_door.movable_parts = {{"door", box_mesh({0.5, 1, 0.02}, 0), {{2.5, 1, 1.5}}}};
  const auto is = bake(with_door, {.settings = {.photons = 1000}});
  const auto expected = bake(two_emitters(), {.settings = {.photons = 1000}});
  ASSERT_TRUE(is.ok() && expected.ok());
  EXPECT_EQ(is->movable_parts, with_door.movable_parts);
  EXPECT_EQ(is->mesh, expected->mesh);
  EXPECT_EQ(is->statistics.warnings, expected->statistics.warnings);
  ASSERT_EQ(is->octree.sources.size(), expected->octree.sources.size());
  for (std::size_t i = 0; i < is->octree.sources.size(); ++i)
    ASSERT_EQ(is->octree.sources[i].position_m, expected->octree.sources[i].position_m);
}

TEST(Bake, DefaultsToPhotonsForAboutTwoHundredThousandSources_NoAsan) {
  const auto contents = bake(two_emitters(), {});
  ASSERT_TRUE(contents.ok());
  EXPECT_GT(contents->settings.photons, 1000u);
  // The pilot of 1024 photons estimates the bounces per photon to a few percent.
  EXPECT_NEAR(static_cast<double>(contents->octree.sources.size()), 200000, 20000);
}

// A cube of 60 m whose walls absorb 6 % decays by 60 dB in 26 s (Eyring), and the emitters of all
// shards are traced for 30 s.
TEST(Bake, OfALongDecayIsTheSameFromTheJournalAndFromShards) {
  const Level level = shoebox({60, 60, 60}, uniform_material(0.06f), {15, 10, 20});
  BakeOptions options{.settings = {.photons = 256, .sources = 2000, .longest_path_s = 0}};
  const testing::TemporaryFile journal("room.journal");
  options.journal = journal.path();
  const auto bytes_of = [](const BakeContents& contents) {
    const testing::TemporaryFile file(".clamor");
    testing::write(contents, file, 1);
    return file.bytes();
  };
  const auto whole = bake(level, options);
  ASSERT_TRUE(whole.ok());
  EXPECT_EQ(whole->settings.longest_path_s, 30);
  BakeReport report;
  const auto again = bake(level, options, &report);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(report.photons_reused, report.photons);
  EXPECT_TRUE(bytes_of(*again) == bytes_of(*whole));

  const testing::TemporaryFile first("first.shard"), second("second.shard");
  for (std::uint32_t i = 0; i < 2; ++i) {
    options.journal = i == 0 ? first.path() : second.path();
    ASSERT_TRUE(bake_shard(level, options, {i, 2}).ok());
  }
  options.journal.clear();
  options.shards = {first.path(), second.path()};
  const auto merged = bake(level, options);
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  EXPECT_TRUE(bytes_of(*merged) == bytes_of(*whole));
}

TEST(Bake, WithoutEmittersExplainsHowToAddOne) {
  Level level = two_emitters();
  level.emitters.clear();
  const auto contents = bake(level, {});
  ASSERT_FALSE(contents.ok());
  EXPECT_NE(contents.error().message.find("--emitter"), std::string::npos);
}

TEST(Bake, WithoutTrianglesIsAFreeFieldWithAWarning) {
  Level level = two_emitters();
  level.mesh = {};
  const auto contents = bake(level, {.settings = {.photons = 1000}});
  ASSERT_TRUE(contents.ok());
  EXPECT_EQ(contents->octree.sources.size(), 2u);
  ASSERT_EQ(contents->statistics.warnings.size(), 1u);
  EXPECT_NE(contents->statistics.warnings[0].find("free field"), std::string::npos);
}

TEST(Bake, StopsOnRequestWithAnError) {
  const std::atomic<bool> stop = true;
  const auto contents = bake(two_emitters(), {.stop = &stop});
  ASSERT_FALSE(contents.ok());
  EXPECT_NE(contents.error().message.find("stopped"), std::string::npos);
}

}  // namespace
}  // namespace clamor
