#include "bake/bake.h"

#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "bake/path_cache.h"
#include "formats/bake_file/bake_contents.h"
#include "tests/bake/energies.h"
#include "tests/rooms.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::Energies;
using testing::open_room;
using testing::shoebox;
using testing::uniform_material;
using testing::with_absorption;

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

Level closed_room(float absorption) {
  return shoebox({5, 4, 3}, uniform_material(absorption, 0.5f, 20), {1.3, 1.7, 1.1});
}

TEST(PathCache, RefusesAFarLongerDecayThanWasTraced) {
  const BakeSettings settings{.photons = 2048, .sources = 20'000, .longest_path_s = 0.5};
  const auto report_of = [&](float from, float to) {
    PathCache cache;
    EXPECT_TRUE(bake(closed_room(from), {.settings = settings, .keeps_paths = &cache}).ok());
    BakeReport report;
    EXPECT_TRUE(bake(closed_room(to), {.settings = settings, .reweighs = &cache}, &report).ok());
    return report;
  };
  // Hardly any photon went further than 0.1 s; they cannot tell what 4 s sound like.
  const BakeReport refused = report_of(0.8f, 0.03f);
  EXPECT_FALSE(refused.is_reweighed);
  EXPECT_EQ(refused.why_traced, "too few of the kept paths carry the new decay");
  EXPECT_TRUE(report_of(0.3f, 0.4f).is_reweighed);
}

TEST(PathCache, LeavesPhotonsThatItCannotKeepToTheJournal) {
  Level level = open_room();
  level.portals.push_back({"door", {2.5, 2, 1.5}, {0, 1, 0}, {0, 0, 1}, true});
  level.portal_materials = {0};
  const testing::TemporaryFile journal("room.journal");
  PathCache cache;
  BakeOptions options{.settings = {.photons = 2048, .sources = 2000, .longest_path_s = 0.1},
                      .keeps_paths = &cache};
  options.journal = journal.path();
  BakeReport again;
  ASSERT_TRUE(bake(level, options).ok());
  ASSERT_TRUE(bake(level, options, &again).ok());
  EXPECT_EQ(again.photons_reused, again.photons);
}

Level with_two_emitters() {
  Level level = closed_room(0.2f);
  level.emitters.resize(2, level.emitters[0]);
  level.emitters[1].name = "other";
  level.emitters[1].position_m = {4, 3, 2};
  return level;
}

// Eyring: a hall of 3840 m3 decays by 60 dB in 7.7 s if its walls absorb 5.2 %, so that paths of 10
// s are enough, and in 13.3 s if they absorb 3 %. Any number of deposits is enough for the cache.
TEST(PathCache, IsNotReweighedWhereTheDecayNeedsLongerPaths_NoAsan) {
  const auto hall = [](float absorption) {
    return shoebox({20, 16, 12}, uniform_material(absorption), {5, 4, 3});
  };
  PathCache cache(PathCache::kMaxBytes, 0);
  BakeOptions options{.settings = {.photons = 512, .sources = 5000, .longest_path_s = 0},
                      .keeps_paths = &cache};
  ASSERT_TRUE(bake(hall(0.052f), options).ok());
  const auto report_of = [&](float absorption) {
    BakeReport report;
    EXPECT_TRUE(
        bake(hall(absorption), {.settings = options.settings, .reweighs = &cache}, &report).ok());
    return report;
  };
  EXPECT_TRUE(report_of(0.053f).is_reweighed);
  const BakeReport longer = report_of(0.03f);
  EXPECT_FALSE(longer.is_reweighed);
  EXPECT_NE(longer.why_traced.find("longer paths"), std::string::npos) << longer.why_traced;
}

// The pilot's noise changes the plan whenever an emitter moves, and with it all photons.
TEST(PathCache, LetsABakeTraceOnlyTheEmitterThatHasMoved_NoAsan) {
  PathCache cache;
  Level level = with_two_emitters();
  BakeOptions options{.settings = {.photons = 6000, .sources = 20'000}, .keeps_paths = &cache};
  ASSERT_TRUE(bake(level, options).ok());
  for (const double step_m : {0.01, 0.1, 0.4, -0.8, -0.5, 0.79}) {
    level.emitters[1].position_m.x += step_m;
    BakeReport report;
    ASSERT_TRUE(bake(level, options, &report).ok());
    EXPECT_EQ(report.photons, 6000u);
    EXPECT_EQ(report.photons_reused, 3000u) << "moved by " << step_m;
  }
  BakeReport report;
  level.materials[0].absorption[2] += 0.02f;
  ASSERT_TRUE(bake(level, {.settings = options.settings, .reweighs = &cache}, &report).ok());
  EXPECT_TRUE(report.is_reweighed) << report.why_traced;
}

TEST(PathCache, LeavesPhotonsToTheJournalWhenItIsFull) {
  const testing::TemporaryFile journal("room.journal");
  PathCache cache(100'000);
  BakeOptions options{.settings = {.photons = 6000, .sources = 20'000}, .keeps_paths = &cache};
  options.journal = journal.path();
  BakeReport report;
  ASSERT_TRUE(bake(with_two_emitters(), options).ok());
  EXPECT_TRUE(cache.is_full());
  ASSERT_TRUE(bake(with_two_emitters(), options, &report).ok());
  EXPECT_EQ(report.photons_reused, 6000u);
  EXPECT_EQ(cache.bytes(), 0u);
}

TEST(PathCache, MakesABakeWithoutTracing) {
  const BakeSettings settings{.photons = 8192, .sources = 40'000};
  const Level edited = with_absorption(open_room(), 0, 0.3f);
  PathCache cache;
  ASSERT_TRUE(bake(open_room(), {.settings = settings, .keeps_paths = &cache}).ok());
  BakeReport report, report_of_fresh;
  const auto one = bake(edited, {.settings = settings, .reweighs = &cache}, &report);
  const auto two = bake(edited, {.settings = settings}, &report_of_fresh);
  ASSERT_TRUE(one.ok() && two.ok());
  EXPECT_TRUE(report.is_reweighed) << report.why_traced;
  EXPECT_EQ(report.photons, 8192u);
  EXPECT_EQ(report.photons_reused, 8192u);
  EXPECT_EQ(report_of_fresh.photons_reused, 0u);
  EXPECT_EQ(one->materials, two->materials);
  EXPECT_NEAR(static_cast<double>(one->octree.sources.size()), 40'000, 400);
  Energies reweighed{}, fresh{};
  for (const auto& [contents, energies] : {std::pair(&*one, &reweighed), {&*two, &fresh}})
    for (const Source& source : contents->octree.sources)
      if (!source.is_emitter) testing::add(*energies, source.delay_s, source.power, 1);
  // Standard errors of 8192 photons are 1 to 3 %.
  for (std::size_t s = 0; s < 3; ++s)
    for (std::size_t b = 0; b < kBandCount; ++b)
      EXPECT_NEAR(reweighed[s][b] / fresh[s][b], 1, 0.15) << "span " << s << ", band " << b;
  for (std::size_t b = 0; b < kBandCount; ++b)
    EXPECT_NEAR(one->statistics.power_escaped[b] / two->statistics.power_escaped[b], 1, 0.1);
}

}  // namespace
}  // namespace clamor
