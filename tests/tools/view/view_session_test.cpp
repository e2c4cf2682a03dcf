// Tests of the window's state without a window.
#include "tools/view/view_session.h"

#include <chrono>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>

#include "tests/box_level.h"
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

TEST(ViewSession, BakesEditsOfALevelThatCouldNotBeReadAtFirst) {
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

TEST(ViewSession, BakesEditsWithTheOptionsOfTheBakeThatItFollows) {
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

}  // namespace
}  // namespace clamor::testing
