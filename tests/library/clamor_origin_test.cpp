// clamor_origin_test.cpp: a level far from the world's origin in the C interface.
#include <vector>

#include <gtest/gtest.h>

#include "formats/bake_file/bake_contents.h"
#include "formats/bake_file/bake_writer.h"
#include "tests/baked_room.h"
#include "tests/library/listened_room.h"
#include "tests/rooms.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::ListenedRoom;

// Tells what is heard of a door, an emitter and a moving source of one bake at an origin.
struct MovedRoom {
  explicit MovedRoom(const Vec3& by_m) : moved_m(by_m) {
    BakeContents contents =
        testing::baked_contents(300, {{"Door", {3, 4, 1.5}, {0, 4, 0}, {0, 0, 1.5}}});
    contents.movable_parts = {{"cage", box_mesh({0.5, 0.5, 0.5}, 0), {{100, 0, 0}}}};
    contents.origin_m = moved_m;
    EXPECT_TRUE(write_bake(file.path(), contents, 1).ok());
  }

  clamor_pose pose(double x, double y, double z) const {
    return {{moved_m.x + x, moved_m.y + y, moved_m.z + z}, {0, 0, 0, 1}};
  }

  std::vector<float> heard() const {
    const ListenedRoom room(file.path());
    clamor_context* const context = room.context.get();
    const clamor_pose ears = pose(4, 5, 1.5), caged = pose(3.5, 4.5, 1.4);
    EXPECT_EQ(clamor_move_listener(context, room.listener, &ears), CLAMOR_OK);
    clamor_part cage = 0;
    EXPECT_EQ(clamor_find_part(context, room.level, "cage", &cage), CLAMOR_OK);
    EXPECT_EQ(clamor_move_part(context, cage, &caged), CLAMOR_OK);
    const std::vector<float> samples(4800, 0.1f);
    clamor_sound sound = 0;
    EXPECT_EQ(clamor_add_sound(context, samples.data(), samples.size(), nullptr, &sound, nullptr),
              CLAMOR_OK);
    clamor_source_options options{};
    options.bytes = sizeof options;
    options.sound = sound;
    options.motion.position_m[0] = moved_m.x + 2;
    options.motion.position_m[1] = moved_m.y + 6;
    options.motion.position_m[2] = moved_m.z + 1;
    clamor_source source = 0;
    EXPECT_EQ(clamor_add_source(context, &options, &source), CLAMOR_OK);
    room.commit();
    return room.heard();
  }

  const Vec3 moved_m;
  const testing::TemporaryFile file{".clamor"};
};

TEST(ClamorOrigin, IsNotHeard) {
  const std::vector<float> near = MovedRoom({0, 0, 0}).heard();
  EXPECT_GT(testing::peak(near), 1e-4);
  for (const Vec3& moved_m : {Vec3(560'000, 0, -180'400), Vec3(500'000, 400, -2'600'000)})
    // 0.01 dB
    EXPECT_LT(testing::largest_difference(near, MovedRoom(moved_m).heard()),
              1e-3 * testing::peak(near));
}

TEST(ClamorOrigin, IsInAllPlacesThatAreTold) {
  const MovedRoom moved({500'000, 400, -2'600'000}), at_origin({0, 0, 0});
  const auto places_of = [](const MovedRoom& room) {
    const ListenedRoom opened(room.file.path());
    clamor_context* const context = opened.context.get();
    clamor_emitter_info emitter{};
    emitter.bytes = sizeof emitter;
    EXPECT_EQ(clamor_get_emitter_info(context, opened.level, 0, &emitter), CLAMOR_OK);
    clamor_portal_info portal{};
    portal.bytes = sizeof portal;
    EXPECT_EQ(clamor_get_portal_info(context, opened.level, 0, &portal), CLAMOR_OK);
    clamor_part cage = 0;
    EXPECT_EQ(clamor_find_part(context, opened.level, "cage", &cage), CLAMOR_OK);
    clamor_part_info part{};
    part.bytes = sizeof part;
    EXPECT_EQ(clamor_get_part_info(context, cage, &part), CLAMOR_OK);
    const auto vector = [](const double(&at)[3]) { return Vec3(at[0], at[1], at[2]); };
    return std::vector<Vec3>{vector(emitter.position_m), vector(portal.centre_m),
                             vector(part.pose.position_m)};
  };
  const auto far = places_of(moved), near = places_of(at_origin);
  for (std::size_t i = 0; i < near.size(); ++i)
    EXPECT_LT(length(far[i] - near[i] - moved.moved_m), 1e-6) << i;
}

}  // namespace
}  // namespace clamor
