// closed_portals_test.cpp: levels that are baked with their portals open and closed.
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "formats/bake_file/expanded_sources.h"
#include "tests/portal_rooms.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::physics_of;
using testing::portal_rooms;
using testing::set_of;
using testing::TemporaryFile;

Level rooms_in_both_states() {
  Level level = portal_rooms();
  level.portals[0].is_baked_closed = true;
  level.materials.push_back(testing::uniform_material(0.6f));
  level.portal_materials = {1};
  return level;
}

// The rooms with a wall in place of the door.
Level rooms_without_door() {
  Level level = portal_rooms(false);
  level.materials.push_back(testing::uniform_material(0.6f));
  testing::add_quad(
      level.mesh, {Vec3f(6, 0, 2.05), Vec3f(6, 0, 2.95), Vec3f(6, 2, 2.95), Vec3f(6, 2, 2.05)}, 1);
  return level;
}

BakeContents baked(const Level& level) {
  auto contents = bake(level, {.settings = {.photons = 2000}, .threads = 2});
  EXPECT_TRUE(contents.ok()) << contents.error().message;
  return std::move(*contents);
}

TEST(ClosedPortals, AddTheSourcesOfTheLevelWithWallsInTheirPlace_NoAsan) {
  const BakeContents both = baked(rooms_in_both_states());
  const auto is_open = [](const PortalSet& set) { return set.has_state(PortalSet::kStateOpen); };
  const auto is_closed = [](const PortalSet& set) {
    return set.has_state(PortalSet::kStateClosed);
  };
  EXPECT_TRUE(physics_of(both, is_open) == physics_of(baked(portal_rooms(false))));
  EXPECT_TRUE(physics_of(both, is_closed) == physics_of(baked(rooms_without_door())));
  for (const Source& source : both.octree.sources) {
    if (!source.is_emitter && is_closed(set_of(both, source))) {
      EXPECT_LT(source.position_m.x, testing::kPortalWall_m + 0.01f);
    }
  }
}

TEST(ClosedPortals, CrossfadeBetweenTheStates) {
  BakedPortals portals;
  portals.portals.resize(3);
  portals.portals[0].is_baked_closed = portals.portals[1].is_baked_closed = true;
  constexpr auto kOpen = PortalSet::kStateOpen, kClosed = PortalSet::kStateClosed;
  portals.sets = {{},
                  {{kOpen, 0, 0, 0}},
                  {{1, kOpen, 0, 0}},
                  {{1, 3, kOpen, 0}},
                  {{kClosed, 0, 0, 0}},
                  {{3, kClosed, 0, 0}}};
  using Shares = std::vector<float>;
  EXPECT_EQ(openness_by_set(portals, {}), (Shares{1, 1, 1, 1, 0, 0}));
  EXPECT_EQ(openness_by_set(portals, Shares{0, 0, 0.5f}), (Shares{1, 0, 0, 0, 1, 0.5f}));
  EXPECT_EQ(openness_by_set(portals, Shares{0.5f, 0.5f, 0.5f}),
            (Shares{1, 0.5f, 0.5f, 0.25f, 0.5f, 0.25f}));
  EXPECT_EQ(openness_by_set(portals, Shares{0, 1}), (Shares{1, 0.5f, 0, 0, 0.5f, 0.5f}));
  portals.portals[1].is_baked_closed = false;  // one portal: its openness is the state's
  EXPECT_EQ(openness_by_set(portals, Shares{0.25f}),
            (Shares{1, 0.25f, 0.25f, 0.25f, 0.75f, 0.75f}));
}

TEST(ClosedPortals, AreOpenForReadersThatSetNothing_NoAsan) {
  const BakeContents both = baked(rooms_in_both_states());
  const auto file = testing::as_file(both);
  EXPECT_TRUE(file->portals() == both.portals);
  const auto all = read_expanded_sources(*file);
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->sources.size(), baked(portal_rooms(false)).octree.sources.size());
  EXPECT_GT(file->source_count(), all->sources.size() + 1000);
}

TEST(ClosedPortals, HaveTheSameBytesFromAJournalAndFromShards_NoAsan) {
  const auto bytes_of = [](BakeOptions options) {
    const auto contents = bake(rooms_in_both_states(), options);
    EXPECT_TRUE(contents.ok()) << contents.error().message;
    const TemporaryFile file(".clamor");
    testing::write(*contents, file);
    return file.bytes();
  };
  BakeOptions options{.settings = {.photons = 3000, .sources = 5000}, .threads = 1};
  options.probes_m = {{2, 1.5, 1.2}};
  options.probe_sources = 300;
  const std::string bytes = bytes_of(options);
  options.threads = 3;
  EXPECT_TRUE(bytes == bytes_of(options));
  const TemporaryFile journal(".journal");
  BakeOptions journaled = options;
  journaled.journal = journal.path();
  EXPECT_TRUE(bytes == bytes_of(journaled));
  BakeReport report;
  ASSERT_TRUE(bake(rooms_in_both_states(), journaled, &report).ok());
  EXPECT_EQ(report.photons, 6000u);
  EXPECT_EQ(report.photons_reused, report.photons + report.probe_photons);
  const TemporaryFile one(".shard"), two(".shard");
  for (std::uint32_t i = 0; i < 2; ++i) {
    BakeOptions of_shard = options;
    of_shard.journal = (i == 0 ? one : two).path();
    ASSERT_TRUE(bake_shard(rooms_in_both_states(), of_shard, {i, 2}).ok());
  }
  options.shards = {two.path(), one.path()};
  EXPECT_TRUE(bytes == bytes_of(options));
}

}  // namespace
}  // namespace clamor
