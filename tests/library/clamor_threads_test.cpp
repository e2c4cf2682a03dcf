// clamor_threads_test.cpp: the C interface called by several threads at once, which ThreadSanitizer
// watches.
#include <array>
#include <atomic>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "runtime/clamor.h"
#include "tests/library/library_room.h"

namespace clamor {
namespace {

using testing::add_listener;
using testing::Context;
using testing::make_context;
using testing::offline;
using testing::open_level;
using testing::pose_of;
using testing::room_without_walls;

// Levels and listeners come and go while one listener is rendered.
void call_on_all_threads(const Context& context, const std::string& path) {
  const clamor_level level = open_level(context, path);
  clamor_listener_options options = offline();
  options.offline = 0;
  const clamor_listener listener = add_listener(context, level, options);
  std::atomic<bool> stop{false};
  std::jthread audio([&] {
    std::array<float, 960> block{};
    while (!stop) EXPECT_EQ(clamor_render(context.get(), listener, block.data(), 480), CLAMOR_OK);
  });
  std::jthread mover([&] {
    for (int i = 0; !stop; ++i) {
      const clamor_pose pose = pose_of(Listener(Vec3(2 + 0.01 * (i % 100), 4, 1.6)));
      EXPECT_EQ(clamor_move_listener(context.get(), listener, &pose), CLAMOR_OK);
      clamor_listener_statistics statistics{};
      statistics.bytes = sizeof(statistics);
      EXPECT_EQ(clamor_get_listener_statistics(context.get(), listener, &statistics), CLAMOR_OK);
    }
  });
  for (int i = 0; i < 10; ++i) {
    const clamor_level again = open_level(context, path);
    const clamor_listener other = add_listener(context, again, options);
    std::array<float, 64> block{};
    EXPECT_EQ(clamor_render(context.get(), other, block.data(), 32), CLAMOR_OK);
    EXPECT_EQ(clamor_enter_level(context.get(), listener, again, nullptr), CLAMOR_OK);
    EXPECT_EQ(clamor_close_level(context.get(), again), CLAMOR_OK);
    EXPECT_EQ(clamor_destroy_listener(context.get(), other), CLAMOR_OK);
  }
  stop = true;
}

TEST(ClamorThreads, MayCallAtOnceWhileTheLibraryUpdates) {
  call_on_all_threads(make_context(false), room_without_walls());
}

TEST(ClamorThreads, MayCallAtOnceWhileOneOfThemUpdates) {
  const Context context = make_context(true);
  std::jthread updater([&](const std::stop_token& stop) {
    while (!stop.stop_requested())
      EXPECT_EQ(clamor_update(context.get(), 0.001, nullptr), CLAMOR_OK);
  });
  call_on_all_threads(context, testing::room());
}

}  // namespace
}  // namespace clamor
