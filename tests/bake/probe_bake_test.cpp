#include <filesystem>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "bake/probe_tracing.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/bake_writer.h"
#include "formats/bake_file/first_leg.h"
#include "tests/rooms.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

constexpr float kAbsorption = 0.2f;

Level room() {
  Level level = testing::shoebox({6, 8, 3}, testing::uniform_material(kAbsorption), {2, 3, 1.5});
  level.signals = {testing::sine(440)};
  return level;
}

BakeOptions with_probes() {
  BakeOptions options;
  options.settings.photons = 2000;
  options.settings.sources = 5000;
  options.probes_m = {{1.5, 2, 1.5}, {4.5, 2, 1.5}, {3, 6, 1.5}};
  options.probe_sources = 1000;
  return options;
}

std::vector<std::byte> bytes_of(const BakeContents& contents) {
  auto bytes = bake_bytes("room.clamor", contents, 1);
  EXPECT_TRUE(bytes.ok()) << bytes.error().message;
  return bytes.ok() ? *bytes : std::vector<std::byte>();
}

double power_of(std::span<const Source> sources, std::size_t band) {
  double sum = 0;
  for (const Source& source : sources) sum += static_cast<double>(source.power[band]);
  return sum;
}

TEST(ProbeBake,
     StoresThePowerThatTheSurfacesReflectOfAnEmitterOfGainOneButForItsFirstReflections_NoAsan) {
  BakeOptions options = with_probes();
  options.probe_sources = 8000;  // all that are early
  const auto contents = bake(room(), options);
  ASSERT_TRUE(contents.ok()) << contents.error().message;
  ASSERT_EQ(contents->probes.places.size(), 3u);
  for (const BakedProbe& probe : contents->probes.places) {
    // The orders from the second on form a geometric series.
    const double all =
        power_of(probe.tree.sources, 0) + power_of(contents->probes.zones[probe.zone].sources, 0);
    const double kept = 1 - kAbsorption;
    EXPECT_NEAR(all / (4 * std::numbers::pi * kept * kept / kAbsorption), 1, 0.1);
    // From a probe to a wall and back to another takes longer than to the nearest wall alone.
    for (const Source& source : probe.tree.sources) {
      const double leg_s =
          length(Vec3(source.position_m) - probe.position_m) / speed_of_sound_mps(Air{});
      ASSERT_GT(static_cast<double>(source.delay_s), leg_s);
    }
  }
}

TEST(ProbeBake, IsTheSameOnOneThreadAndOnTwoAndFromShards_NoAsan) {
  BakeOptions options = with_probes();
  options.threads = 1;
  const auto one = bake(room(), options);
  options.threads = 2;
  const auto two = bake(room(), options);
  ASSERT_TRUE(one.ok() && two.ok());
  const auto expected = bytes_of(*one);
  EXPECT_TRUE(bytes_of(*two) == expected);

  const testing::TemporaryFile first("first.shard"), second("second.shard");
  for (std::uint32_t i = 0; i < 2; ++i) {
    BakeOptions shard = options;
    shard.journal = i == 0 ? first.path() : second.path();
    const auto traced = bake_shard(room(), shard, {i, 2});
    ASSERT_TRUE(traced.ok()) << traced.error().message;
  }
  options.shards = {second.path(), first.path()};
  const auto merged = bake(room(), options);
  ASSERT_TRUE(merged.ok()) << merged.error().message;
  EXPECT_TRUE(bytes_of(*merged) == expected);
}

TEST(ProbeBake, FindsItsProbesInTheJournal) {
  const testing::TemporaryFile journal("room.journal");
  BakeOptions options = with_probes();
  options.journal = journal.path();
  const auto first = bake(room(), options);
  ASSERT_TRUE(first.ok());
  BakeReport again;
  const auto second = bake(room(), options, &again);
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(again.photons_reused, again.photons + again.probe_photons);
  EXPECT_TRUE(bytes_of(*second) == bytes_of(*first));
}

TEST(ProbeBake, NeedsNoEmitter) {
  Level level = room();
  level.emitters.clear();
  const auto contents = bake(level, with_probes());
  ASSERT_TRUE(contents.ok()) << contents.error().message;
  EXPECT_EQ(contents->source_count(), 0u);
  EXPECT_GT(contents->probes.places[0].tree.sources.size(), 100u);
  EXPECT_FALSE(bytes_of(*contents).empty());
}

TEST(ProbeBake, GivesProbesInAFreeFieldNothing) {
  Level level = room();
  level.mesh = {};
  const auto contents = bake(level, with_probes());
  ASSERT_TRUE(contents.ok()) << contents.error().message;
  for (const BakedProbe& probe : contents->probes.places) EXPECT_TRUE(probe.tree.sources.empty());
  EXPECT_FALSE(bytes_of(*contents).empty());
}

TEST(ProbeBake, IsReadFromTheFileAsItWasBaked) {
  const auto contents = bake(room(), with_probes());
  ASSERT_TRUE(contents.ok());
  const testing::TemporaryFile path("room.clamor");
  ASSERT_TRUE(write_bake(path.path(), *contents, 1).ok());
  const auto file = BakeFile::open(path.path());
  ASSERT_TRUE(file.ok()) << file.error().message;
  ASSERT_EQ(file->probes().places.size(), 3u);
  std::size_t probe = 0;
  for (const StoredProbe& stored : file->probes().places) {
    const BakedProbe& baked = contents->probes.places[probe++];
    EXPECT_EQ(stored.position_m, baked.position_m);
    EXPECT_EQ(stored.zone, baked.zone);
    const auto top = file->read_page(stored.tree.top);
    ASSERT_TRUE(top.ok()) << top.error().message;
    for (std::size_t i = 0; i < top->sources.size(); ++i) {
      EXPECT_EQ(top->sources[i].position_m, baked.tree.sources[i].position_m);
      EXPECT_EQ(top->sources[i].emitter, baked.tree.sources[i].emitter);
      EXPECT_EQ(top->sources[i].power, baked.tree.sources[i].power);
    }
  }
}

// Outside, sound leaves the walls once and for all, so that the zone has no late reflections.
TEST(ProbeBake, IsReadWholeWhereAZoneIsEmpty) {
  BakeOptions options = with_probes();
  options.probes_m.insert(options.probes_m.begin(), {3, 4, 20});
  options.settings.photons = 20'000;
  const testing::TemporaryFile path("room.clamor");
  const auto contents = bake(room(), options);
  ASSERT_TRUE(contents.ok()) << contents.error().message;
  ASSERT_TRUE(contents->probes.zones[0].sources.empty());
  ASSERT_GT(contents->probes.zones[1].nodes.size(), 1u);
  ASSERT_TRUE(write_bake(path.path(), *contents, 1).ok());
  const auto file = BakeFile::open(path.path());
  ASSERT_TRUE(file.ok()) << file.error().message;
  std::size_t pages = 0;
  const auto read = file->for_each_probe_page(
      [&](const PageEntry&, const OctreePage&, std::size_t, std::size_t) -> Result<void> {
        ++pages;
        return {};
      });
  EXPECT_TRUE(read.ok()) << read.error().message;
  EXPECT_GT(pages, 6u);
}

TEST(FirstLeg, IsReadAsItWasStored) {
  for (const Vec3f& direction :
       {Vec3f(1, 0, 0), Vec3f(0, -1, 0), normalize(Vec3f(1, 2, -3)), normalize(Vec3f(-1, -5, 2))})
    for (const float distance_m : {0.06f, 1.0f, 17.0f, 4000.0f}) {
      const std::uint32_t code = first_leg_code({direction, distance_m});
      EXPECT_LT(code, kFirstLegCodes);
      const FirstLeg leg = first_leg_of(code);
      EXPECT_GT(dot(leg.direction, direction), std::cos(0.05));
      EXPECT_NEAR(leg.distance_m / distance_m, 1, 0.03);
    }
}

}  // namespace
}  // namespace clamor
