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

void bake_box(const std::string& level, const std::string& output, const std::string& seed) {
  ASSERT_EQ(clamor({"bake", level, "-o", output, "--quiet", "--photons", "200", "--sources", "200",
                    "--emitter", "name=hiss,signal=noise,at=1,1,1", "--seed", seed, "--no-journal"})
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

TEST(ViewSession, BakesEditsOfALevelThatCouldNotBeReadAtFirst) {
  const Folder folder;
  const std::string level = box_level(folder), bake = folder / "box.clamor",
                    next = folder / "next.clamor";
  bake_box(level, bake, "1");
  bake_box(level, next, "2");
  folder.write("box.gltf", "half of a file");
  ViewOptions options;
  options.path = bake;
  options.player.device = "none";
  options.made_by.emplace();
  options.made_by->level_path = level;
  options.made_by->import.emitters = {"name=hiss,signal=noise,at=1,1,1"};
  options.made_by->photons = "200";
  options.made_by->sources = "200";
  const auto session = ViewSession::open(options);
  ASSERT_TRUE(session.ok()) << session.error().message;
  ViewSession& view = **session;
  EXPECT_FALSE(view.is_editable());

  box_level(folder);
  std::filesystem::rename(next, bake);
  draw_until(view, [&] { return view.followed() > 0; });
  ASSERT_TRUE(view.is_editable());
  ASSERT_TRUE(view.level().set_preset(0, "brick").ok());
  draw_until(view, [&] { return view.newest_bake().has_value(); });
  EXPECT_EQ(view.newest_bake()->error, "");
}

}  // namespace
}  // namespace clamor::testing
