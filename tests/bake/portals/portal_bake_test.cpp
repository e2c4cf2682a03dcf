// portal_bake_test.cpp: which portals the sound of each secondary source has passed.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bake/bake.h"
#include "bake/probes/probe_zones.h"
#include "bake/trace/scene.h"
#include "formats/bake_file/first_leg.h"
#include "tests/portal_rooms.h"
#include "tests/rooms.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::baked_portal_rooms;
using testing::physics_of;
using testing::portal_rooms;
using testing::set_of;
using testing::TemporaryFile;

TEST(PortalBake, MarksAllSourcesOfTheFarRoomAndNoEarlyOneOfTheNearRoom) {
  const BakeContents contents = baked_portal_rooms();
  std::size_t far = 0, returned = 0, near = 0;
  for (const Source& source : contents.octree.sources) {
    if (source.is_emitter) {
      EXPECT_EQ(source.emitter, 0u);
      continue;
    }
    const bool passed = !set_of(contents, source).is_empty();
    if (source.position_m.x > testing::kPortalWall_m + 0.01f) {
      ++far;
      EXPECT_TRUE(passed) << source.position_m.x << " " << source.delay_s;
    } else if (source.position_m.x < testing::kPortalWall_m - 0.01f) {
      returned += passed;
      near += !passed;
      // The way to the door and back is at least 8 m long.
      EXPECT_FALSE(passed && source.delay_s < 0.02f);
    }
  }
  EXPECT_GT(far, 1000u);
  EXPECT_GT(returned, 100u);
  EXPECT_GT(near, far);
}

TEST(PortalBake, ChangesNoSourceButItsEmitter_NoAsan) {
  const BakeContents with = baked_portal_rooms(true), without = baked_portal_rooms(false);
  EXPECT_TRUE(physics_of(with) == physics_of(without));
  EXPECT_EQ(with.statistics.decay, without.statistics.decay);
  EXPECT_TRUE(without.portals == BakedPortals{});
}

TEST(PortalBake, KeepsTheFirstFourOfMorePortals) {
  Level level = testing::shoebox({14, 3, 3}, testing::uniform_material(0.1f), {1, 1.5, 1.5});
  for (int p = 1; p <= 6; ++p)
    level.portals.push_back({std::to_string(p), {2.0 * p, 1.5, 1.5}, {0, 1.6, 0}, {0, 0, 1.6}});
  const auto contents = bake(level, {.settings = {.photons = 1000}, .threads = 1});
  ASSERT_TRUE(contents.ok());
  std::size_t deepest = 0;
  for (const Source& source : contents->octree.sources) {
    if (source.is_emitter) continue;
    const PortalSet set = set_of(*contents, source);
    const auto slab = static_cast<std::size_t>(source.position_m.x / 2);  // portals between
    EXPECT_TRUE(set.is_valid(6));
    // Positions are rounded to the grid of the file.
    const float beside_m = source.position_m.x - 2 * std::round(source.position_m.x / 2);
    if (std::abs(beside_m) > 0.01f) {
      EXPECT_GE(set.size(), std::min<std::size_t>(slab, 4));
    }
    // Whatever passed the second passed the first.
    EXPECT_TRUE(set.is_empty() || set.numbers[0] == 1);
    deepest += slab == 6;
  }
  EXPECT_GT(deepest, 100u);
  // None, and the first one to four.
  EXPECT_EQ(contents->portals.sets.size(), 5u);
}

std::string bytes_of(const BakeOptions& options) {
  const auto contents = bake(portal_rooms(), options);
  EXPECT_TRUE(contents.ok()) << contents.error().message;
  if (!contents.ok()) return "";
  const TemporaryFile file(".clamor");
  testing::write(*contents, file);
  return file.bytes();
}

BakeOptions options_with_probes(int threads) {
  BakeOptions options{.settings = {.photons = 4000, .sources = 20'000}, .threads = threads};
  options.probes_m = {{2, 1.5, 1.2}, {9, 1.5, 3}};
  options.probe_sources = 500;
  return options;
}

TEST(PortalBake, HasTheSameBytesOnAnyThreadsFromAJournalAndFromShards_NoAsan) {
  const std::string bytes = bytes_of(options_with_probes(1));
  EXPECT_TRUE(bytes == bytes_of(options_with_probes(3)));
  const TemporaryFile journal(".journal");
  BakeOptions options = options_with_probes(2);
  options.journal = journal.path();
  EXPECT_TRUE(bytes == bytes_of(options));
  BakeReport report;
  ASSERT_TRUE(bake(portal_rooms(), options, &report).ok());
  EXPECT_EQ(report.photons_reused, report.photons + report.probe_photons);

  const TemporaryFile one(".shard"), two(".shard");
  for (std::uint32_t i = 0; i < 2; ++i) {
    BakeOptions of_shard = options_with_probes(2);
    of_shard.journal = (i == 0 ? one : two).path();
    ASSERT_TRUE(bake_shard(portal_rooms(), of_shard, {i, 2}).ok());
  }
  BakeOptions merged = options_with_probes(2);
  merged.shards = {two.path(), one.path()};
  EXPECT_TRUE(bytes == bytes_of(merged));
}

TEST(PortalBake, TracesAgainWhenAPortalMoves) {
  const TemporaryFile journal(".journal");
  BakeOptions options{.settings = {.photons = 2000}, .threads = 2};
  options.journal = journal.path();
  ASSERT_TRUE(bake(portal_rooms(), options).ok());
  Level moved = portal_rooms();
  moved.portals[0].centre_m.y += 0.1;
  BakeReport report;
  ASSERT_TRUE(bake(moved, options, &report).ok());
  EXPECT_EQ(report.photons_reused, 0u);
}

TEST(PortalBake, MarksTheSourcesOfProbes) {
  const auto contents = bake(portal_rooms(), options_with_probes(2));
  ASSERT_TRUE(contents.ok());
  std::size_t far = 0, passed = 0;
  const auto check = [&](const SourceOctree& tree, bool in_first) {
    for (const Source& source : tree.sources) {
      const PortalSet set = contents->portals.sets.at(source.path.portal_set);
      const float x = source.position_m.x - testing::kPortalWall_m;
      passed += !set.is_empty();
      if (in_first ? x < 0.01f : x > -0.01f) continue;
      ++far;
      EXPECT_FALSE(set.is_empty());
    }
  };
  for (const BakedProbe& probe : contents->probes.places) {
    check(probe.tree, probe.position_m.x < 6);
    check(contents->probes.zones[probe.zone], probe.position_m.x < 6);
  }
  EXPECT_GT(far, 20u);
  EXPECT_GE(passed, far);
}

TEST(PortalBake, SharesNoLateReflectionsAcrossAPortal) {
  const Level hall = testing::shoebox({12, 3, 5}, testing::uniform_material(0.2f), {3, 1.5, 2.5});
  const Scene scene(hall.mesh);
  const std::array places_m = {Vec3(4.5, 1.5, 2.5), Vec3(7.5, 1.5, 2.5), Vec3(5, 1.5, 3.5)};
  EXPECT_THAT(group_probes(scene, {}, places_m).sizes, ::testing::ElementsAre(3));
  Portal across{"across", {6, 1.5, 2.5}, {0, 1.5, 0}, {0, 0, 2.5}};
  const ProbeZones zones = group_probes(scene, std::span(&across, 1), places_m);
  EXPECT_THAT(zones.sizes, ::testing::ElementsAre(2, 1));
  EXPECT_THAT(zones.order, ::testing::ElementsAre(0, 2, 1));
  // Sound passes beside it.
  across.centre_m.z = 6;
  EXPECT_THAT(group_probes(scene, std::span(&across, 1), places_m).sizes,
              ::testing::ElementsAre(3));
}

}  // namespace
}  // namespace clamor
