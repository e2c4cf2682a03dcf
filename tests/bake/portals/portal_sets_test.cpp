#include "bake/portals/portal_sets.h"

#include <gtest/gtest.h>

#include "formats/bake_file/first_leg.h"
#include "tests/portal_rooms.h"

namespace clamor {
namespace {

using testing::set_with;

TEST(PortalSet, KeepsTheFirstFourInAscendingOrder) {
  const PortalSet set = set_with({7, 2, 7, 1023, 0, 5});
  EXPECT_EQ(set.numbers, (std::array<std::uint16_t, 4>{1, 3, 8, 1024}));
  EXPECT_TRUE(set.is_valid(1024));
  EXPECT_FALSE(set.is_valid(1023));
  EXPECT_FALSE((PortalSet{{2, 2, 0, 0}}).is_valid(9));
  EXPECT_FALSE((PortalSet{{0, 2, 0, 0}}).is_valid(9));
  EXPECT_TRUE(PortalSet{}.is_valid(0));
}

TEST(PortalSetTable, CountsASetWithoutRoomAsItsLargestSubset) {
  PortalSetTable table;
  EXPECT_EQ(table.number_of(PortalSet{}), 0u);
  EXPECT_EQ(table.number_of(set_with({1}), 4), 1u);
  EXPECT_EQ(table.number_of(set_with({2}), 4), 2u);
  EXPECT_EQ(table.number_of(set_with({2, 3}), 4), 3u);
  EXPECT_EQ(table.number_of(set_with({1, 2, 3}), 4), 3u);
  EXPECT_EQ(table.number_of(set_with({1, 2}), 4), 1u);  // of two as large, the first
  EXPECT_EQ(table.number_of(set_with({5, 6}), 4), 0u);
  EXPECT_EQ(table.sets().size(), 4u);
}

TEST(PortalPairs, RanksSetsByThePowerOfTheirSources) {
  PortalPairs pairs(10);
  std::vector<Source> sources(4);
  sources[0].emitter = pairs.number_of(3, set_with({0}));
  sources[1].emitter = pairs.number_of(3, PortalSet{});
  sources[2].emitter = pairs.number_of(1, set_with({0, 1}));
  sources[3].emitter = pairs.number_of(3, set_with({0}));
  EXPECT_EQ(pairs.number_of(9, set_with({4})), 12u);  // none of its sources is kept
  for (std::size_t i = 0; i < sources.size(); ++i) sources[i].power[0] = i == 2 ? 5.0f : 1.0f;
  PortalSetTable table;
  std::vector<PortalEmitter> emitters;
  pairs.count(sources);
  pairs.number(table, kMaxPortalSets, emitters);
  pairs.apply(sources);
  EXPECT_EQ(emitters, (std::vector<PortalEmitter>{{1, 1}, {3, 2}}));
  EXPECT_EQ(table.sets(), (std::vector<PortalSet>{{}, set_with({0, 1}), set_with({0})}));
  EXPECT_EQ(sources[0].emitter, 11u);
  EXPECT_EQ(sources[1].emitter, 3u);
  EXPECT_EQ(sources[2].emitter, 10u);
  EXPECT_EQ(sources[3].emitter, 11u);
}

TEST(ProbePortalSets, StandBesideTheFirstLeg) {
  PortalSetTable table;
  (void)table.number_of(set_with({8}));
  ProbePortalSets sets;
  std::vector<Source> sources(3);
  sources[0].path = sets.path_of(1234, set_with({1}));
  sources[1].path = sets.path_of(77, set_with({8}));
  sources[2].path = sets.path_of(kFirstLegCodes - 1, PortalSet{});
  for (Source& source : sources) source.power = same_in_all_bands(1);
  sets.finish(sources, table);
  EXPECT_EQ(sources[0].path.portal_set, 2u);
  EXPECT_EQ(sources[0].path.first_leg, 1234u);
  EXPECT_EQ(sources[1].path.portal_set, 1u);
  EXPECT_EQ(sources[1].path.first_leg, 77u);
  EXPECT_EQ(sources[1].emitter, 77 + kFirstLegCodes) << "one word of a page";
  EXPECT_EQ(sources[2].emitter, kFirstLegCodes - 1);
}

}  // namespace
}  // namespace clamor
