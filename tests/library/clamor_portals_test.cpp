// clamor_portals_test.cpp: the portals of a level in the C interface, in a room that one divides.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "common/sample_rate.h"
#include "runtime/clamor.h"
#include "tests/library/library_room.h"
#include "tests/library/listened_room.h"

namespace clamor {
namespace {

using testing::add_listener;
using testing::largest_difference;
using testing::peak;

struct PortalRoom : testing::ListenedRoom {
  clamor_result set(double openness) const {
    return clamor_set_portal(context.get(), level, 0, openness);
  }
};

std::vector<float> with_openness(double openness) {
  const PortalRoom room;
  EXPECT_EQ(room.set(openness), CLAMOR_OK);
  room.commit();
  return room.heard();
}

// Closed form: every reflection passed the portal or did not, and amplitudes add.
TEST(ClamorPortals, ScaleTheAmplitudeOfWhatPassedThem_NoAsan) {
  const auto untouched = PortalRoom().heard(), open = with_openness(1), half = with_openness(0.25),
             closed = with_openness(0);
  EXPECT_EQ(untouched, open);
  EXPECT_GT(largest_difference(open, closed), 0.02 * peak(open));
  std::vector<float> mean = open;
  for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = 0.5f * (open[i] + closed[i]);
  EXPECT_LT(largest_difference(half, mean), 1e-5 * peak(open));
}

TEST(ClamorPortals, AreGivenBackToTheirParts) {
  const PortalRoom room;
  EXPECT_EQ(room.set(0), CLAMOR_OK);
  room.commit();
  (void)room.heard();
  EXPECT_EQ(room.set(CLAMOR_PORTAL_BY_PARTS), CLAMOR_OK);
  room.commit();
  (void)room.heard();  // it has none, and is open
  const PortalRoom untouched;
  for (int i = 0; i < 2; ++i) (void)untouched.heard();
  const auto expected = untouched.heard();
  EXPECT_LT(largest_difference(expected, room.heard()), 0.001 * peak(expected));
}

TEST(ClamorPortals, ChangeWithTheNextCommitForEveryListener) {
  const PortalRoom room;
  const clamor_listener other = add_listener(room.context, room.level);
  EXPECT_NE(other, 0u);
  (void)room.heard();
  ASSERT_EQ(room.set(0), CLAMOR_OK);
  (void)room.heard();
  room.commit();
  (void)room.heard();
  const auto closed = room.heard();
  ASSERT_EQ(room.set(1), CLAMOR_OK);
  room.commit();
  (void)room.heard();
  EXPECT_GT(largest_difference(closed, room.heard()), 0.02 * peak(closed));
}

TEST(ClamorPortals, AreListedAndFoundByName) {
  const PortalRoom room;
  clamor_level_info level{};
  level.bytes = sizeof(level);
  ASSERT_EQ(clamor_get_level_info(room.context.get(), room.level, &level), CLAMOR_OK);
  EXPECT_EQ(level.portals, 1u);
  EXPECT_EQ(level.emitters, 3u) << "virtual emitters are not listed";
  clamor_portal_info info{};
  info.bytes = sizeof(info);
  ASSERT_EQ(clamor_get_portal_info(room.context.get(), room.level, 0, &info), CLAMOR_OK);
  EXPECT_STREQ(info.name, "Door");
  EXPECT_EQ(info.centre_m[1], 4);
  EXPECT_EQ(info.half_v_m[2], 1.5);
  uint32_t found = 7;
  EXPECT_EQ(clamor_find_portal(room.context.get(), room.level, "Door", &found), CLAMOR_OK);
  EXPECT_EQ(found, 0u);
  EXPECT_EQ(clamor_find_portal(room.context.get(), room.level, "Gate", &found),
            CLAMOR_ERROR_NOT_FOUND);
}

TEST(ClamorPortals, AreRefusedOutOfRange) {
  const PortalRoom room;
  for (const double openness : {-0.1, 1.1, std::nan(""), HUGE_VAL})
    EXPECT_EQ(room.set(openness), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(clamor_set_portal(room.context.get(), room.level, 1, 1), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(clamor_set_portal(room.context.get(), 12345, 0, 1), CLAMOR_ERROR_HANDLE);
  EXPECT_EQ(clamor_set_portal(nullptr, room.level, 0, 1), CLAMOR_ERROR_ARGUMENT);
}

}  // namespace
}  // namespace clamor
