// Tests of the window's state without a window.
#include "tools/view/view_session.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>

#include "tests/box_level.h"
#include "tests/door_level.h"
#include "tests/tools/run_clamor.h"

namespace clamor::testing {
namespace {

const std::string kEmitter = "name=hiss,signal=noise,at=1,1,1";

void bake_box(const std::string& level, const std::string& output, const std::string& seed) {
  ASSERT_EQ(clamor({"bake", level, "-o", output, "--quiet", "--photons", "200", "--sources", "200",
                    "--emitter", kEmitter, "--seed", seed, "--no-journal"})
                .code,
            0);
}

// Draws frames until a condition holds; CTest ends a test that waits for ever.
template <class Condition>
void draw_until(ViewSession& session, const Condition& condition) {
  while (!condition()) {
    session.frame({}, 0.01);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

// A window that shows a bake of bake_box().
ViewOptions options_of(const std::string& bake, const std::string& level) {
  ViewOptions options;
  options.path = bake;
  options.player.device = "none";
  options.made_by = [level](const BakeFile& file) {
    BakeRequest request;
    request.level_path = level;
    request.import.emitters = {kEmitter};
    request.photons = "200";
    request.sources = "200";
    request.seed = std::to_string(file.settings().seed);
    return request;
  };
  return options;
}

// A level, its bake, and another one to replace that with, of seeds 1 and 2.
struct TwoBakes {
  TwoBakes() {
    bake_box(level, bake, "1");
    bake_box(level, next, "2");
  }

  Folder folder;
  std::string level = box_level(folder), bake = folder / "box.clamor",
              next = folder / "next.clamor";
};

TEST(ViewSession, BakesEditsOfALevelThatCouldNotBeReadAtFirst_NoAsan) {
  const TwoBakes of;
  of.folder.write("box.gltf", "half of a file");
  const auto session = ViewSession::open(options_of(of.bake, of.level));
  ASSERT_TRUE(session.ok()) << session.error().message;
  ViewSession& view = **session;
  EXPECT_FALSE(view.is_editable());

  box_level(of.folder);
  std::filesystem::rename(of.next, of.bake);
  draw_until(view, [&] { return view.followed() > 0; });
  ASSERT_TRUE(view.is_editable());
  ASSERT_TRUE(view.level().set_preset(0, "brick").ok());
  draw_until(view, [&] { return view.newest_bake().has_value(); });
  EXPECT_EQ(view.newest_bake()->error, "");
}

TEST(ViewSession, BakesEditsWithTheOptionsOfTheBakeThatItFollows_NoAsan) {
  const TwoBakes of;
  const auto session = ViewSession::open(options_of(of.bake, of.level));
  ASSERT_TRUE(session.ok()) << session.error().message;
  ViewSession& view = **session;
  std::filesystem::rename(of.next, of.bake);
  draw_until(view, [&] { return view.followed() > 0; });
  ASSERT_TRUE(view.level().set_preset(0, "brick").ok());
  draw_until(view, [&] { return view.newest_bake().has_value(); });
  const auto edited = BakeFile::open(view.newest_bake()->path);
  ASSERT_TRUE(edited.ok()) << view.newest_bake()->error;
  EXPECT_EQ(edited->settings().seed, 2u);
}

// Reflections that are heard from walls of the listener's room, all of which came through the door.
std::size_t reflections_here(const ViewSession& view) {
  std::size_t count = 0;
  for (const HeardSource& source : view.heard())
    count += source.part != SoundPart::kDirect && source.position_m.x > kDoorWall_m + 0.1f;
  return count;
}

// The clearest source in the emitter's room.
float clearest_there(const ViewSession& view) {
  float clearest = 0;
  for (const HeardSource& source : view.heard())
    if (source.position_m.x < kDoorWall_m - 0.1f) clearest = std::max(clearest, source.power_gain);
  return clearest;
}

// A window that shows a bake of two rooms with a door, whose listener is in the other room.
struct TwoRooms {
  TwoRooms() {
    folder.write("rooms.acoustics.json", R"({"movable": ["Door"], "portals": [
      {"name": "gate", "at": [6, 1, 2.5], "size": [0.9, 2], "facing": [1, 0, 0], "parts": []}]})");
    EXPECT_EQ(clamor({"bake", level, "-o", bake, "--quiet", "--photons", "2000", "--sources",
                      "2000", "--emitter", "name=hiss,signal=noise,at=2,1.5,1.2", "--early-order",
                      "0", "--no-journal"})
                  .code,
              0);
    options.path = bake;
    options.player.device = "none";
    options.listener = Listener{{9, 1.5, 2.5}, 1.57, 0};
  }

  Folder folder;
  std::string level = door_level(folder), bake = folder / "rooms.clamor";
  ViewOptions options;
};

TEST(ViewSession, OpensAndClosesAPortalWhichIsHeard_NoAsan) {
  const TwoRooms of;
  const auto session = ViewSession::open(of.options);
  ASSERT_TRUE(session.ok()) << session.error().message;
  ViewSession& view = **session;
  view.doors().move_part(0, 1);  // out of the way
  draw_until(view, [&] { return reflections_here(view) > 0; });
  const Selection portal{Selection::Kind::kPortal, 0, 0};
  EXPECT_TRUE(view.is_open(portal));
  view.set_open(portal, false);
  draw_until(view, [&] { return !view.heard().empty() && reflections_here(view) == 0; });
  EXPECT_FALSE(view.is_open(portal));
}

TEST(ViewSession, MovesADoorWhichThenHidesNothingAnyMore_NoAsan) {
  const TwoRooms of;
  const auto session = ViewSession::open(of.options);
  ASSERT_TRUE(session.ok()) << session.error().message;
  ViewSession& view = **session;
  ASSERT_EQ(view.parts().size(), 1u);
  draw_until(view, [&] { return !view.heard().empty() && clearest_there(view) < 0.5f; });
  const auto before = view.part_vertices();
  view.camera().place({{7.5, 1.5, 2.5}, 1.57, 0});
  view.toggle_door();
  EXPECT_TRUE(view.is_open({Selection::Kind::kPart, 0, 0}));
  draw_until(view, [&] { return clearest_there(view) > 0.5f; });
  EXPECT_NE(view.part_vertices()[0].position_m, before[0].position_m) << "it is drawn there";
}

}  // namespace
}  // namespace clamor::testing
