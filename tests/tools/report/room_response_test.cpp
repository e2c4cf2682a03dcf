// Tests the responses of a report against those of all sources.
#include "tools/report/room_response.h"

#include <algorithm>
#include <cmath>

#include "formats/bake_file/bake_metadata.h"
#include "tests/tools/report/reported_room.h"

namespace clamor::testing {
namespace {

class RoomMeterTest : public ::testing::Test {
 protected:
  RoomMeterTest()
      : reported_(shoebox({6, 4, 3}, uniform_material(0.2f), {2, 1, 1})),
        room_(reported_.room()),
        meter_(room_, *excitation_of(room_, "")) {}

  ReportedRoom reported_;
  Room room_;
  RoomMeter meter_;
};

TEST_F(RoomMeterTest, WithAllSourcesGivesTheResponseOfClamorImpulse) {
  const Vec3 place_m(4.5, 1.7, 2);
  const auto expected =
      energy_response(room_.sources, room_.emitters(), room_.file->materials(),
                      room_.file->settings().air, place_m, 0, room_.surfaces.get());
  const RoomResponse response = meter_.measure(place_m, RoomMeter::kAll);
  ASSERT_EQ(response.arrivals.size(), expected.size());
  const auto parameters = room_parameters(expected, meter_.excitation().energy_at_10m);
  for (const ParameterKind& kind : kParameterKinds)
    for (std::size_t b = 0; b < kBandCount; ++b)
      EXPECT_NEAR((response.parameters.*kind.value)[b].value_or(-1),
                  (parameters.*kind.value)[b].value_or(-1), 1e-9)
          << kind.name;
}

// A tenth of the sources has an energy that errs by 4.34 / sqrt(1000) = 0.14 dB at most, and T30 by
// a few per cent, since half of the sample falls to all times alike.
TEST_F(RoomMeterTest, WithATenthOfThemIsRightWithinAJustNoticeableDifference) {
  for (const Vec3& place_m : {Vec3(4.5, 1.7, 2), Vec3(1, 1.5, 2.5), Vec3(3, 2.5, 0.5)}) {
    const RoomResponse all = meter_.measure(place_m, RoomMeter::kAll);
    const RoomResponse some = meter_.measure(place_m, 1500);
    EXPECT_LT(some.sources, 1600u);
    for (const ParameterKind& kind : kParameterKinds)
      for (std::size_t b = 1; b < 7; ++b) {
        const auto &a = (all.parameters.*kind.value)[b], &s = (some.parameters.*kind.value)[b];
        ASSERT_TRUE(a && s) << kind.name << b;
        EXPECT_NEAR(*s, *a, 1.5 * kind.noticeable_at(std::abs(*a))) << kind.name << b;
      }
  }
}

// In an empty box nothing is hidden, so straight lines are exact.
TEST_F(RoomMeterTest, QuickGivesTheSameWhereNothingIsHidden) {
  const Vec3 place_m(4.5, 1.7, 2);
  const RoomParameters quick = meter_.quick(place_m, RoomMeter::kAll);
  const RoomParameters fine = meter_.measure(place_m, RoomMeter::kAll).parameters;
  for (std::size_t b = 1; b < 7; ++b) {
    EXPECT_NEAR(*quick.t30_s[b], *fine.t30_s[b], 0.01 * *fine.t30_s[b]);
    EXPECT_NEAR(*quick.g_db[b], *fine.g_db[b], 0.1);
  }
}

// Images are as loud as their mirrors make them, and those without a path are silent.
TEST(RoomMeter, QuickHearsTheImagesThatAPathLeadsTo) {
  Level level = shoebox({6, 4, 3}, uniform_material(0.2f, 0, kMirrorExponent), {2, 1, 1});
  // A wall across half of the room hides some.
  for (const double z : {0.0, 1.0})
    add_quad(level.mesh, {Vec3f(3, 0, z), Vec3f(3, 3, z), Vec3f(3, 3, z + 1), Vec3f(3, 0, z + 1)});
  const ReportedRoom reported(level);
  const Room room = reported.room();
  ASSERT_GT(std::ranges::count_if(room.sources, [](const Source& one) { return one.is_image; }),
            20);
  const RoomMeter meter(room, *excitation_of(room, ""));
  for (const Vec3& place_m : {Vec3(4.5, 1.7, 2.5), Vec3(1, 1.5, 2.5), Vec3(4, 3, 1)}) {
    const RoomParameters quick = meter.quick(place_m, RoomMeter::kAll);
    const RoomParameters fine = meter.measure(place_m, RoomMeter::kAll).parameters;
    // Only diffraction is missing, which is least at high frequencies.
    for (std::size_t b = 4; b < 8; ++b) {
      EXPECT_NEAR(*quick.g_db[b], *fine.g_db[b], 0.5) << b;
      EXPECT_NEAR(*quick.c80_db[b], *fine.c80_db[b], 1) << b;
    }
  }
}

TEST(RoomMeterOfALargeBake, IsUnbiasedWithTheStrongestSourcesAlone) {
  const ReportedRoom reported(shoebox({6, 4, 3}, uniform_material(0.2f), {2, 1, 1}));
  const Room whole = reported.room(), part = reported.room(4000);
  ASSERT_GT(part.missing_key, 0);
  const auto excitation = *excitation_of(whole, "");
  const Vec3 place_m(4.5, 1.7, 2);
  const auto all = RoomMeter(whole, excitation).measure(place_m, RoomMeter::kAll).parameters;
  const auto strongest = RoomMeter(part, excitation).measure(place_m, RoomMeter::kAll).parameters;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    EXPECT_NEAR(*strongest.g_db[b], *all.g_db[b], 0.3);
    EXPECT_NEAR(*strongest.c80_db[b], *all.c80_db[b], 0.6);
  }
}

}  // namespace
}  // namespace clamor::testing
