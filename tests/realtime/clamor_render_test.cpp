// clamor_render_test.cpp: the audio-thread calls of the C interface, a million of them, while the
// library's threads and the game's move, update and change levels.
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/clamor.h"
#include "tests/library/library_room.h"
#include "tests/realtime/forbidden.h"

namespace clamor {
namespace {

using testing::add_listener;
using testing::Context;
using testing::Forbidden;
using testing::make_context;
using testing::open_level;

constexpr std::uint32_t kMaxRender_frames = 4096, kMaxRender_channels = 16;

struct RenderedFormat {
  const char* name;
  std::uint32_t output, rate_hz;
  const char* layout;
  int calls;
};
constexpr std::array kRenderedFormats = {
    RenderedFormat{"receivers", CLAMOR_OUTPUT_RECEIVERS, 48'000, nullptr, 920'000},
    RenderedFormat{"receivers at 44.1 kHz", CLAMOR_OUTPUT_RECEIVERS, 44'100, nullptr, 20'000},
    RenderedFormat{"binaural", CLAMOR_OUTPUT_BINAURAL, 48'000, nullptr, 20'000},
    RenderedFormat{"5.1", CLAMOR_OUTPUT_LOUDSPEAKERS, 48'000, "5.1", 20'000},
    RenderedFormat{"ambisonics", CLAMOR_OUTPUT_AMBISONICS, 48'000, nullptr, 20'000}};

// Results of the audio thread's calls.
struct Rendered {
  int failures = 0;
  long page_faults = 0;
  double energy = 0;
};

// Renders blocks of 16 frames and more, interleaved and planar in turn. The first call on a thread
// touches its stack, and is not counted.
Rendered render_on_audio_thread(clamor_context* context, clamor_listener listener, int calls) {
  Rendered rendered;
  std::vector<float> samples(kMaxRender_frames * kMaxRender_channels);
  std::array<float*, kMaxRender_channels> planes{};
  for (std::size_t c = 0; c < planes.size(); ++c) planes[c] = &samples[c * kMaxRender_frames];
  std::jthread([&] {
    std::minstd_rand random(1);
    rendered.failures += clamor_render(context, listener, samples.data(), 16) != CLAMOR_OK;
    const long before = testing::page_faults();
    {
      const Forbidden forbidden;
      for (int i = 0; i < calls; ++i) {
        const std::uint32_t frames =
            i % 2048 == 2047 ? 16 + random() % (kMaxRender_frames - 15) : 16 + random() % 5;
        const clamor_result result =
            i % 2 == 0 ? clamor_render(context, listener, samples.data(), frames)
                       : clamor_render_planar(context, listener, planes.data(), frames);
        rendered.failures += result != CLAMOR_OK;
        rendered.energy += static_cast<double>(samples[0]) * samples[0];
      }
    }
    rendered.page_faults = testing::page_faults() - before;
  }).join();
  return rendered;
}

clamor_listener_options options_of(const RenderedFormat& way) {
  clamor_listener_options options{};
  options.bytes = sizeof(options);
  options.output = way.output;
  options.layout = way.layout;
  options.rate_hz = way.rate_hz;
  options.voices = 12;
  options.limits = 1;
  options.pose = {{2, 4, 1.6}, {}};
  return options;
}

// Moves the listener and, now and then, has it enter the other level, until `stop`.
void walk(clamor_context* context, clamor_listener listener,
          const std::array<clamor_level, 2>& levels, const std::atomic<bool>& stop) {
  for (int i = 0; !stop; ++i) {
    const double t = 0.01 * i;
    const clamor_pose pose = {{3 + 2.5 * std::sin(3 * t), 4 + 3.5 * std::cos(2 * t), 1.5},
                              {0, std::sin(t), 0, std::cos(t)}};
    EXPECT_EQ(clamor_move_listener(context, listener, &pose), CLAMOR_OK);
    if (i % 100 == 99) {
      EXPECT_EQ(clamor_enter_level(context, listener, levels[i / 100 % 2], nullptr), CLAMOR_OK);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

TEST(ClamorRender, AsksTheSystemForNothingInAMillionCalls) {
  const Context context = make_context(false);
  const std::array levels = {open_level(context), open_level(context)};
  double energy = 0;
  for (const RenderedFormat& way : kRenderedFormats) {
    SCOPED_TRACE(way.name);
    const clamor_listener listener = add_listener(context, levels[0], options_of(way));
    std::atomic<bool> stop{false};
    std::jthread walker([&] { walk(context.get(), listener, levels, stop); });
    const Rendered rendered = render_on_audio_thread(context.get(), listener, way.calls);
    stop = true;
    EXPECT_EQ(rendered.failures, 0);
    EXPECT_EQ(rendered.page_faults, 0);
    energy += rendered.energy;
    walker.join();
    EXPECT_EQ(clamor_destroy_listener(context.get(), listener), CLAMOR_OK);
  }
  EXPECT_GT(energy, 0);
}

// Calls that fail are as harmless: a game may render a listener that it has just destroyed.
TEST(ClamorRender, AsksTheSystemForNothingWhenItFails) {
  const Context context = make_context(true);
  const clamor_listener listener =
      add_listener(context, open_level(context), options_of(kRenderedFormats[0]));
  ASSERT_EQ(clamor_destroy_listener(context.get(), listener), CLAMOR_OK);
  std::array<float, 64> block{};
  const Forbidden forbidden;
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(clamor_render(context.get(), listener, block.data(), 32), CLAMOR_ERROR_HANDLE);
    EXPECT_EQ(clamor_render(nullptr, listener, block.data(), 32), CLAMOR_ERROR_ARGUMENT);
    EXPECT_EQ(clamor_render_planar(context.get(), 7, nullptr, 32), CLAMOR_ERROR_ARGUMENT);
  }
}

}  // namespace
}  // namespace clamor
