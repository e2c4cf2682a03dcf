// clamor_parts_test.cpp: movable parts in the C interface: cages around a listener in a small room.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "common/sample_rate.h"
#include "runtime/clamor.h"
#include "tests/library/library_room.h"
#include "tests/library/listened_room.h"

namespace clamor {
namespace {

using testing::add_listener;
using testing::Context;
using testing::largest_difference;
using testing::make_context;
using testing::offline;
using testing::open_level;
using testing::peak;

// Peaks. Gains glide, so that what is silenced takes a second to be below the last bit.
constexpr double kSilent = 1e-5, kAudible = 1e-3;
constexpr clamor_pose kAtListener{{2, 4, 1.6}, {0, 0, 0, 1}}, kAway{{100, 0, 0}, {0, 0, 0, 1}};

struct PartRoom : testing::ListenedRoom {
  using ListenedRoom::ListenedRoom;

  static clamor_part_options box(double transmission = 0) {
    clamor_part_options options{};
    options.bytes = sizeof(options);
    options.pose = kAtListener;
    std::fill_n(options.half_extents_m, 3, 0.5);
    std::fill_n(options.transmission, 8, transmission);
    return options;
  }
  clamor_part add(const clamor_part_options& options) const {
    clamor_part part = 0;
    clamor_error error;
    EXPECT_EQ(clamor_add_part(context.get(), &options, &part, &error), CLAMOR_OK) << error.sentence;
    return part;
  }
  void move(clamor_part part, const clamor_pose& pose) const {
    EXPECT_EQ(clamor_move_part(context.get(), part, &pose), CLAMOR_OK);
  }
};

// Half a second of the room as it is.
std::vector<std::vector<float>> undisturbed() {
  const PartRoom room;
  return {room.heard(), room.heard(), room.heard()};
}

TEST(ClamorParts, SilenceWhatTheyEncloseAndLeaveNothingBehind_NoAsan) {
  const auto expected = undisturbed();
  const PartRoom room;
  const clamor_part cage = room.add(PartRoom::box());
  EXPECT_GT(peak(room.heard()), kAudible);  // nothing is committed
  room.commit();
  room.heard();
  EXPECT_LT(peak(room.heard()), kSilent);
  EXPECT_EQ(clamor_remove_part(room.context.get(), cage), CLAMOR_OK);
  room.commit();
  room.heard();
  EXPECT_GT(peak(room.heard()), kAudible);

  const PartRoom before;
  EXPECT_EQ(clamor_remove_part(before.context.get(), before.add(PartRoom::box())), CLAMOR_OK);
  before.commit();
  for (const auto& samples : expected) EXPECT_EQ(before.heard(), samples);
}

TEST(ClamorParts, TransmitAShareOfThePower) {
  const auto expected = undisturbed();
  const PartRoom room;
  room.add(PartRoom::box(0.25));
  room.commit();
  for (const auto& samples : expected)
    EXPECT_LT(largest_difference(room.heard(), samples, 0.5), 1e-4 * peak(samples));
}

// A screen beside the emitter and the listener, which hides only what the wall behind it reflects.
TEST(ClamorParts, ReflectWhatTheyNeitherAbsorbNorScatter_NoAsan) {
  const auto heard_with = [](double absorption, double scattering) {
    const PartRoom room;
    clamor_part_options screen = PartRoom::box();
    screen.pose = {{0.3, 3.5, 1.4}, {0, 0, 0, 1}};
    screen.half_extents_m[0] = 0.02;
    screen.half_extents_m[1] = 1.5;
    screen.half_extents_m[2] = 1;
    std::fill_n(screen.absorption, 8, absorption);
    std::fill_n(screen.scattering, 8, scattering);
    room.add(screen);
    room.commit();
    (void)room.heard();
    return room.heard();
  };
  const auto absorbing = heard_with(1, 0), reflecting = heard_with(0, 0);
  EXPECT_EQ(heard_with(0, 1), absorbing);
  EXPECT_EQ(heard_with(0.1, 0), reflecting);
  EXPECT_GT(largest_difference(reflecting, absorbing), 0.02 * peak(absorbing));
}

TEST(ClamorParts, MayBeMeshesThatMoveAndAreDisabled) {
  const PartRoom room;
  const float v[] = {-1, -1, -1, 1, -1, -1, 0, 1, -1, 0, 0, 1};
  const std::uint32_t faces[] = {0, 1, 2, 0, 1, 3, 1, 2, 3, 2, 0, 3};  // a tetrahedron
  clamor_part_options options = PartRoom::box();
  std::fill_n(options.half_extents_m, 3, 0.0);
  options.vertices_m = v;
  options.indices = faces;
  options.vertices = 4;
  options.triangles = 4;
  options.pose = kAway;
  const clamor_part part = room.add(options);
  const auto becomes_silent = [&](bool silent) {
    room.commit();
    room.heard();
    EXPECT_EQ(peak(room.heard()) < kSilent, silent);
  };
  becomes_silent(false);
  room.move(part, kAtListener);
  becomes_silent(true);
  EXPECT_EQ(clamor_enable_part(room.context.get(), part, 0), CLAMOR_OK);
  becomes_silent(false);
  EXPECT_EQ(clamor_enable_part(room.context.get(), part, 1), CLAMOR_OK);
  becomes_silent(true);
  room.move(part, kAway);
  becomes_silent(false);
}

TEST(ClamorParts, OfALevelAreFoundByNumberAndName) {
  const PartRoom room(testing::room_with_cage());
  clamor_context* const context = room.context.get();
  clamor_level_info level{};
  level.bytes = sizeof(level);
  ASSERT_EQ(clamor_get_level_info(context, room.level, &level), CLAMOR_OK);
  EXPECT_EQ(level.parts, 1u);
  clamor_part part = 0, same = 0;
  ASSERT_EQ(clamor_find_part(context, room.level, "cage", &part), CLAMOR_OK);
  ASSERT_EQ(clamor_get_level_part(context, room.level, 0, &same), CLAMOR_OK);
  EXPECT_EQ(part, same);
  EXPECT_EQ(clamor_find_part(context, room.level, "door", &same), CLAMOR_ERROR_NOT_FOUND);
  EXPECT_EQ(clamor_get_level_part(context, room.level, 1, &same), CLAMOR_ERROR_ARGUMENT);
  clamor_part_info info{};
  info.bytes = sizeof(info);
  ASSERT_EQ(clamor_get_part_info(context, part, &info), CLAMOR_OK);
  EXPECT_EQ(info.triangles, 12u);
  EXPECT_EQ(info.level, room.level);
  EXPECT_EQ(info.pose.position_m[0], 100);
  EXPECT_STREQ(info.name, "cage");
  EXPECT_EQ(clamor_remove_part(context, part), CLAMOR_ERROR_STATE);

  EXPECT_GT(peak(room.heard()), kAudible);
  room.move(part, kAtListener);
  room.commit();
  room.heard();
  EXPECT_LT(peak(room.heard()), kSilent);
  EXPECT_EQ(clamor_close_level(context, room.level), CLAMOR_OK);
  EXPECT_EQ(clamor_move_part(context, part, &kAway), CLAMOR_ERROR_HANDLE);
  room.commit();
  EXPECT_LT(peak(room.heard()), kSilent);  // the listener is still there, and so is the cage
}

TEST(ClamorParts, OccludeForEachListenerWhereItIs) {
  const PartRoom room;
  clamor_listener_options options = offline();
  options.voices = 100'000;
  options.pose = {{4, 2, 1.6}, {}};
  const clamor_listener other = add_listener(room.context, room.level, options);
  clamor_part_options elsewhere = PartRoom::box();
  elsewhere.level = open_level(room.context);
  room.add(elsewhere);  // in a level where nobody is
  room.commit();
  EXPECT_GT(peak(room.heard()), kAudible);
  room.add(PartRoom::box());
  room.commit();
  room.heard();
  EXPECT_LT(peak(room.heard()), kSilent);
  EXPECT_GT(peak(room.heard(other)), kAudible);
}

TEST(ClamorParts, OccludeInAFreeField_NoAsan) {
  const PartRoom room(testing::room_without_walls());
  EXPECT_GT(peak(room.heard()), kAudible);
  const clamor_part part = room.add(PartRoom::box());
  room.commit();
  room.heard();
  EXPECT_LT(peak(room.heard()), kSilent);
  EXPECT_EQ(clamor_remove_part(room.context.get(), part), CLAMOR_OK);
  room.commit();
  room.heard();
  EXPECT_GT(peak(room.heard()), kAudible);
}

TEST(ClamorParts, RefuseHostilePosesAndShapes) {
  const PartRoom room;
  clamor_context* const context = room.context.get();
  const clamor_part part = room.add(PartRoom::box());
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double x : {kNan, kInfinity, 1e30, -1.1e8}) {
    const clamor_pose at{{x, 0, 0}, {0, 0, 0, 1}}, turned{{}, {0, 0, x, kNan}};
    EXPECT_EQ(clamor_move_part(context, part, &at), CLAMOR_ERROR_ARGUMENT);
    EXPECT_EQ(clamor_move_part(context, part, &turned), CLAMOR_ERROR_ARGUMENT);
  }
  const clamor_pose no_rotation{};
  EXPECT_EQ(clamor_move_part(context, part, &no_rotation), CLAMOR_ERROR_ARGUMENT);
  clamor_part added = 7;
  const auto refuses = [&](const clamor_part_options& options) {
    clamor_error error;
    EXPECT_EQ(clamor_add_part(context, &options, &added, &error), CLAMOR_ERROR_ARGUMENT);
    EXPECT_NE(error.sentence[0], 0);
    EXPECT_EQ(added, 7u);
  };
  for (const double extent : {kNan, 0.0, -1.0, 1e30, 1e-9}) {
    clamor_part_options options = PartRoom::box();
    options.half_extents_m[1] = extent;
    refuses(options);
  }
  for (const double share : {kNan, -0.1, 1.1}) {
    clamor_part_options options = PartRoom::box();
    options.transmission[7] = share;
    refuses(options);
    for (double(*shares)[8] : {&options.absorption, &options.scattering}) {
      options = PartRoom::box();
      (*shares)[7] = share;
      refuses(options);
    }
  }
  clamor_part_options nothing = PartRoom::box();
  std::fill_n(nothing.half_extents_m, 3, 0.0);
  refuses(nothing);
  room.commit();
  room.heard();
  EXPECT_LT(peak(room.heard()), kSilent);  // the part is where it was
}

TEST(ClamorParts, AreLimitedInNumber) {
  const Context context = make_context();
  const clamor_part_options options = PartRoom::box();
  clamor_part part = 0;
  for (int i = 0; i < 4096; ++i)
    ASSERT_EQ(clamor_add_part(context.get(), &options, &part, nullptr), CLAMOR_OK);
  const clamor_part last = part;
  EXPECT_EQ(clamor_add_part(context.get(), &options, &part, nullptr), CLAMOR_ERROR_FULL);
  EXPECT_EQ(part, last);
  EXPECT_EQ(clamor_remove_part(context.get(), last), CLAMOR_OK);
  EXPECT_EQ(clamor_add_part(context.get(), &options, &part, nullptr), CLAMOR_OK);
  EXPECT_EQ(clamor_move_part(context.get(), last, &kAway), CLAMOR_ERROR_HANDLE);
}

}  // namespace
}  // namespace clamor
