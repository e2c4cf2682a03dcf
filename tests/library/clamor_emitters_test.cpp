// clamor_emitters_test.cpp: the emitters of a level in the C interface, in a small room with three.
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

using testing::largest_difference;
using testing::peak;

struct EmitterRoom : testing::ListenedRoom {
  clamor_result change(uint32_t emitter, double gain, clamor_group group = 0) const {
    clamor_emitter_options options{};
    options.bytes = sizeof(options);
    options.has_gain = 1;
    options.gain = gain;
    options.group = group;
    return clamor_change_emitter(context.get(), level, emitter, &options);
  }
};

// The first quarter of a second of a room whose emitters have these gains from the beginning on.
std::vector<float> with_gains(double first, double second, double third) {
  const EmitterRoom room;
  EXPECT_EQ(room.change(0, first), CLAMOR_OK);
  EXPECT_EQ(room.change(1, second), CLAMOR_OK);
  EXPECT_EQ(room.change(2, third), CLAMOR_OK);
  room.commit();
  return room.heard();
}

clamor_group_options group_options(double gain) {
  clamor_group_options options{};
  options.bytes = sizeof(options);
  options.has_gain = 1;
  options.gain = gain;
  return options;
}

// Closed form: amplitudes add.
TEST(ClamorEmitters, AddUpWithTheirGains_NoAsan) {
  const auto untouched = EmitterRoom().heard(), all = with_gains(1, 1, 1),
             mixed = with_gains(1, 0.5, 0.1), first = with_gains(1, 0, 0),
             second = with_gains(0, 1, 0), third = with_gains(0, 0, 1);
  EXPECT_EQ(untouched, all);
  std::vector<float> sum = first;
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += 0.5f * second[i] + 0.1f * third[i];
  EXPECT_LT(largest_difference(mixed, sum), 1e-5 * peak(untouched));
  EXPECT_GT(largest_difference(mixed, untouched), 0.05 * peak(untouched));
}

TEST(ClamorEmitters, GoOnIfTheyLoopWhereAListenerEntersALevel_NoAsan) {
  const EmitterRoom stays, enters;
  for (const EmitterRoom* const room : {&stays, &enters}) {
    EXPECT_EQ(room->change(2, 0), CLAMOR_OK);  // which clicks once
    room->commit();
    for (int first = 0; first < 4; ++first)
      EXPECT_EQ(clamor_update(room->context.get(), 0, nullptr), CLAMOR_OK);
  }
  EXPECT_EQ(stays.heard(), enters.heard());
  EXPECT_EQ(clamor_enter_level(enters.context.get(), enters.listener, enters.level, nullptr),
            CLAMOR_OK);
  const auto one = stays.heard(), other = enters.heard();
  EXPECT_LT(largest_difference(one, other), 1e-3 * peak(one));
}

TEST(ClamorEmitters, FollowTheirGroupAndAreNeverLouderThanTheBake_NoAsan) {
  const EmitterRoom room;
  const clamor_group_options unchanged = group_options(1);
  clamor_group group = 0;
  ASSERT_EQ(clamor_add_group(room.context.get(), &unchanged, &group), CLAMOR_OK);
  for (const uint32_t emitter : {0u, 1u, 2u})
    ASSERT_EQ(room.change(emitter, 0.5, group), CLAMOR_OK);
  room.commit();
  EXPECT_EQ(room.heard(), with_gains(0.5, 0.5, 0.5));
  // What is heard after a change of the group is complete.
  const auto level_with = [&](const clamor_group_options& options) {
    EXPECT_EQ(clamor_change_group(room.context.get(), group, &options), CLAMOR_OK);
    room.commit();
    (void)room.heard();
    return peak(room.heard());
  };
  const double half = level_with(unchanged);
  EXPECT_NEAR(level_with(group_options(0.5)) / half, 0.5, 1e-3);
  EXPECT_LT(level_with(group_options(0)) / half, 1e-5);
  EXPECT_NEAR(level_with(group_options(100)) / half, 2, 1e-3);
  clamor_group_options paused = unchanged;
  paused.is_paused = 1;
  EXPECT_LT(level_with(paused) / half, 1e-5);
  ASSERT_EQ(clamor_remove_group(room.context.get(), group), CLAMOR_OK);
  room.commit();
  (void)room.heard();
  EXPECT_NEAR(peak(room.heard()) / half, 1, 1e-3);
}

TEST(ClamorEmitters, AreFoundByName) {
  const EmitterRoom room;
  clamor_emitter_info info{};
  info.bytes = sizeof(info);
  ASSERT_EQ(clamor_get_emitter_info(room.context.get(), room.level, 2, &info), CLAMOR_OK);
  EXPECT_EQ(info.sound, 2u);
  EXPECT_EQ(info.position_m[1], 4.5);
  EXPECT_EQ(info.gain, 1);
  uint32_t found = 99;
  const auto find = [&](const char* name) {
    return clamor_find_emitter(room.context.get(), room.level, name, &found);
  };
  EXPECT_EQ(find("nobody"), CLAMOR_ERROR_NOT_FOUND);
  EXPECT_EQ(find(nullptr), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(found, 99u);
  EXPECT_EQ(find(info.name), CLAMOR_OK);
  EXPECT_EQ(found, 0u);  // the first of the three, which have one name
}

TEST(ClamorEmitters, RejectWhatIsWrong) {
  const EmitterRoom room;
  EXPECT_EQ(room.change(3, 1), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(room.change(0, 1.01), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(room.change(0, -1), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(room.change(0, std::nan("")), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(room.change(0, 1, 12345), CLAMOR_ERROR_HANDLE);
  clamor_emitter_info info{};
  info.bytes = sizeof(info);
  EXPECT_EQ(clamor_get_emitter_info(room.context.get(), room.level, 3, &info),
            CLAMOR_ERROR_ARGUMENT);
  ASSERT_EQ(clamor_close_level(room.context.get(), room.level), CLAMOR_OK);
  EXPECT_EQ(room.change(0, 1), CLAMOR_ERROR_HANDLE);
  EXPECT_EQ(clamor_get_emitter_info(room.context.get(), room.level, 0, &info), CLAMOR_ERROR_HANDLE);
}

}  // namespace
}  // namespace clamor
