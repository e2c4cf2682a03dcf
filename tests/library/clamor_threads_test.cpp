// clamor_threads_test.cpp: the C interface called by several threads at once, which ThreadSanitizer
// watches.
#include <array>
#include <atomic>
#include <chrono>
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

// Four threads call: levels and listeners come and go while listeners are rendered, moved and
// asked.
void call_on_all_threads(const Context& context, const std::string& path) {
  const clamor_level level = open_level(context, path);
  clamor_listener_options options = offline();
  options.offline = 0;
  const clamor_listener listener = add_listener(context, level, options);
  std::atomic<bool> stop{false};
  std::jthread audio([&] {
    std::array<float, 960> block{};
    while (!stop) {
      const clamor_result rendered = clamor_render(context.get(), listener, block.data(), 480);
      EXPECT_TRUE(rendered == CLAMOR_OK || rendered == CLAMOR_ERROR_BUSY) << rendered;
    }
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
  // Asks about what may be gone, and makes mistakes.
  std::atomic<clamor_listener> last{listener};
  std::jthread asker([&] {
    std::array<float, 32> block{};
    for (int i = 0; !stop; ++i) {
      const clamor_listener asked = last;
      uint32_t channels = 0, wanted = 0;
      double time_s = 0;
      for (const clamor_result result :
           {clamor_get_channels(context.get(), asked, &channels),
            clamor_next_keyframe(context.get(), asked, &wanted, &time_s),
            i % 8 == 0 ? clamor_enter_level(context.get(), asked, level, nullptr) : CLAMOR_OK})
        EXPECT_TRUE(result == CLAMOR_OK || result == CLAMOR_ERROR_HANDLE) << result;
      // The listener that the audio thread renders is busy, or was not at this moment.
      const clamor_result rendered = clamor_render(context.get(), asked, block.data(), 16);
      EXPECT_TRUE(rendered == CLAMOR_OK || rendered == CLAMOR_ERROR_HANDLE ||
                  rendered == CLAMOR_ERROR_BUSY)
          << rendered;
      EXPECT_EQ(clamor_close_level(context.get(), asked), CLAMOR_ERROR_HANDLE);
      std::this_thread::sleep_for(
          std::chrono::microseconds(200));  // or it would hold up the others
    }
  });
  for (int i = 0; i < 5; ++i) {
    const clamor_level again = open_level(context, path);
    const clamor_listener other = add_listener(context, again, options);
    last = other;
    std::array<float, 64> block{};
    const clamor_result rendered = clamor_render(context.get(), other, block.data(), 32);
    EXPECT_TRUE(rendered == CLAMOR_OK || rendered == CLAMOR_ERROR_BUSY) << rendered;
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

// Sounds and sources come and go while a stream is written and all of them are rendered.
TEST(ClamorThreads, MayAddSoundsAndSourcesAndWriteStreamsWhileTheyAreRendered) {
  const Context context = make_context(false);
  const clamor_level level = open_level(context, testing::silent_field());
  clamor_listener_options options = offline();
  options.offline = 0;
  const clamor_listener listener = add_listener(context, level, options);
  clamor_stream stream{};
  stream.bytes = sizeof(stream);
  clamor_sound speech = 0;
  ASSERT_EQ(clamor_add_stream(context.get(), &stream, &speech, nullptr), CLAMOR_OK);
  std::atomic<bool> stop{false};
  std::jthread audio([&] {
    std::array<float, 960> block{};
    while (!stop) EXPECT_EQ(clamor_render(context.get(), listener, block.data(), 480), CLAMOR_OK);
  });
  std::jthread speaker([&] {
    const std::array<float, 480> samples{0.5f, -0.5f};
    while (!stop) {
      EXPECT_EQ(clamor_write_stream(context.get(), speech, samples.data(), 480, nullptr),
                CLAMOR_OK);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  const std::array<float, 4800> samples{1, -1};
  for (int i = 0; i < 20; ++i) {
    clamor_sound sound = 0;
    clamor_sound_options sound_options{};
    sound_options.bytes = sizeof(sound_options);
    sound_options.loops = i % 2;
    ASSERT_EQ(clamor_add_sound(context.get(), samples.data(), samples.size(), &sound_options,
                               &sound, nullptr),
              CLAMOR_OK);
    clamor_source_options source_options{};
    source_options.bytes = sizeof(source_options);
    source_options.motion.position_m[2] = -2;
    clamor_source source = 0, speaking = 0;
    source_options.sound = sound;
    EXPECT_EQ(clamor_add_source(context.get(), &source_options, &source), CLAMOR_OK);
    source_options.sound = speech;
    EXPECT_EQ(clamor_add_source(context.get(), &source_options, &speaking), CLAMOR_OK);
    EXPECT_EQ(clamor_commit(context.get(), 0), CLAMOR_OK);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    EXPECT_EQ(clamor_remove_source(context.get(), speaking), CLAMOR_OK);
    EXPECT_EQ(clamor_remove_sound(context.get(), sound), CLAMOR_OK);
    EXPECT_EQ(clamor_commit(context.get(), 0), CLAMOR_OK);
  }
  stop = true;
}

}  // namespace
}  // namespace clamor
