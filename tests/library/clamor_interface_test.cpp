// clamor_interface_test.cpp: the C interface as an application uses it: against renders of the same
// walk, and with wrong arguments.
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/air.h"
#include "formats/level/walk_file.h"
#include "runtime/clamor.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/player/render.h"
#include "tests/baked_room.h"
#include "tests/library/library_room.h"
#include "tests/rooms.h"
#include "tests/temporary_file.h"
#include "tests/walks.h"

namespace clamor {
namespace {

using testing::add_listener;
using testing::Context;
using ::testing::HasSubstr;
using testing::make_context;
using testing::offline;
using testing::open_level;
using testing::pose_of;
using testing::room;

std::string bytes_of_room() {
  std::ifstream file(room(), std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// A level that is silent but for one endless tone.
std::string tone_level(const testing::TemporaryFile& file, double frequency_hz) {
  Level level = testing::shoebox({6, 8, 3}, testing::uniform_material(0.9f), {2, 3, 1.2});
  level.signals = {testing::sine(frequency_hz)};
  BakeOptions options;
  options.settings.photons = 100;
  EXPECT_TRUE(write_bake(file.path(), *bake(level, options), 1).ok());
  return file.path();
}

// Makes the keyframes that an offline listener wants, each with the walk's pose at its time.
void make_keyframes(const Context& context, clamor_listener listener, const Walk& walk) {
  uint32_t wanted = 0;
  double time_s = 0;
  while (clamor_next_keyframe(context.get(), listener, &wanted, &time_s) == CLAMOR_OK && wanted) {
    const clamor_pose pose = pose_of(walk.at(time_s));
    ASSERT_EQ(clamor_move_listener(context.get(), listener, &pose), CLAMOR_OK);
    ASSERT_EQ(clamor_update(context.get(), 0, nullptr), CLAMOR_OK);
  }
}

std::vector<float> heard(const Context& context, clamor_listener listener, const Walk& walk,
                         std::size_t frames, std::size_t block_frames) {
  uint32_t channels = 0;
  EXPECT_EQ(clamor_get_channels(context.get(), listener, &channels), CLAMOR_OK);
  std::vector<float> samples(frames * channels);
  for (std::size_t done = 0; done < frames; done += block_frames) {
    make_keyframes(context, listener, walk);
    const auto now = static_cast<uint32_t>(std::min(block_frames, frames - done));
    EXPECT_EQ(clamor_render(context.get(), listener, &samples[done * channels], now), CLAMOR_OK);
  }
  return samples;
}

std::vector<float> rendered(const Walk& walk, std::size_t frames, const OutputFormat& output = {}) {
  AuralizerOptions options;
  options.voices = 100;
  options.output = output;
  options.wait_for_pages = true;
  auto auralizer = Auralizer::create(
      std::make_shared<const BakeFile>(std::move(*BakeFile::open(room()))), options);
  std::vector<float> samples;
  EXPECT_TRUE(render(**auralizer, walk, frames, [&](std::span<const float> block) {
                samples.insert(samples.end(), block.begin(), block.end());
                return Result<void>();
              }).ok());
  return samples;
}

TEST(ClamorInterface, RendersTheSamplesOfAnOfflineRenderForAnyBlocks) {
  const Walk walk = testing::across_the_room();
  constexpr std::size_t kFrames = 12'007;
  const std::vector<float> expected = rendered(walk, kFrames);
  EXPECT_GT(*std::max_element(expected.begin(), expected.end()), 0.001f);
  for (const std::size_t block_frames : {16, 441, 4096}) {
    const Context context = make_context();
    const clamor_listener listener = add_listener(context, open_level(context));
    EXPECT_EQ(heard(context, listener, walk, kFrames, block_frames), expected) << block_frames;
  }
}

TEST(ClamorInterface, RendersSeveralListenersInTheirOwnFormats) {
  const Walk walk = testing::across_the_room();
  constexpr std::size_t kFrames = 4'800;
  const Context context = make_context();
  const clamor_level level = open_level(context);
  clamor_listener_options speakers = offline(), ambisonics = offline();
  speakers.output = CLAMOR_OUTPUT_LOUDSPEAKERS;
  speakers.layout = "5.1";
  ambisonics.output = CLAMOR_OUTPUT_AMBISONICS;
  const auto first = add_listener(context, level, speakers);
  const auto second = add_listener(context, level, ambisonics);
  EXPECT_EQ(heard(context, first, walk, kFrames, 480),
            rendered(walk, kFrames, *OutputFormat::from_options(false, "5.1", false)));
  // An update serves all listeners, so the second has keyframes of the pose that it had meanwhile.
  const auto other = make_context();
  const auto alone = add_listener(other, open_level(other), ambisonics);
  EXPECT_EQ(heard(other, alone, walk, kFrames, 480),
            rendered(walk, kFrames, *OutputFormat::from_options(false, "", true)));
  uint32_t channels = 0;
  EXPECT_EQ(clamor_get_channels(context.get(), second, &channels), CLAMOR_OK);
  EXPECT_EQ(channels, 16u);
}

TEST(ClamorInterface, WritesPlanesThatEqualTheInterleavedChannels) {
  const Walk walk = testing::across_the_room();
  constexpr uint32_t kFrames = 700;
  const Context context = make_context();
  const clamor_listener listener = add_listener(context, open_level(context));
  make_keyframes(context, listener, walk);
  std::vector<float> left(kFrames), right(kFrames);
  float* const planes[] = {left.data(), right.data()};
  ASSERT_EQ(clamor_render_planar(context.get(), listener, planes, kFrames), CLAMOR_OK);
  const std::vector<float> expected = rendered(walk, kFrames);
  for (std::size_t i = 0; i < kFrames; ++i) {
    ASSERT_EQ(left[i], expected[2 * i]);
    ASSERT_EQ(right[i], expected[2 * i + 1]);
  }
}

int32_t read_from(void* user, uint64_t offset, uint64_t count, void* into) {
  EXPECT_GT(count, 0u);
  const auto& bytes = *static_cast<const std::string*>(user);
  if (offset > bytes.size() || count > bytes.size() - offset) return 1;
  std::memcpy(into, bytes.data() + offset, count);
  return 0;
}

TEST(ClamorInterface, ReadsALevelFromMemoryOrTheApplicationLikeAFile) {
  const Walk walk = testing::across_the_room();
  const std::vector<float> expected = rendered(walk, 4'800);
  static std::string bytes;
  static int released;
  bytes = bytes_of_room();
  for (const bool in_memory : {true, false}) {
    released = 0;
    clamor_reader reader{};
    reader.bytes = sizeof(reader);
    reader.size = bytes.size();
    reader.user = &bytes;
    if (in_memory)
      reader.memory = bytes.data();
    else
      reader.read = read_from;
    reader.release = [](void*) { ++released; };
    {
      const Context context = make_context();
      clamor_level level = 0;
      ASSERT_EQ(clamor_open_level_with(context.get(), &reader, &level, nullptr), CLAMOR_OK);
      const clamor_listener listener = add_listener(context, level);
      EXPECT_EQ(clamor_close_level(context.get(), level), CLAMOR_OK);
      EXPECT_EQ(released, 0) << "the listener still hears it";
      EXPECT_EQ(heard(context, listener, walk, 4'800, 480), expected);
    }
    EXPECT_EQ(released, 1);
  }
}

// A callback that calls the library must not find it locked by the call that it is called from.
TEST(ClamorInterface, MayBeCalledFromTheReleaseOfALevel) {
  const Context context = make_context();
  std::string bytes = bytes_of_room();
  struct Archive {
    clamor_context* context;
    clamor_level other;
    clamor_result result;
  } archive{context.get(), open_level(context), CLAMOR_ERROR_INTERNAL};
  clamor_reader reader{};
  reader.bytes = sizeof(reader);
  reader.size = bytes.size();
  reader.memory = bytes.data();
  reader.user = &archive;
  reader.release = [](void* user) {
    auto& called = *static_cast<Archive*>(user);
    called.result = clamor_close_level(called.context, called.other);
  };
  clamor_level level = 0;
  ASSERT_EQ(clamor_open_level_with(context.get(), &reader, &level, nullptr), CLAMOR_OK);
  EXPECT_EQ(clamor_close_level(context.get(), level), CLAMOR_OK);
  EXPECT_EQ(archive.result, CLAMOR_OK);
}

TEST(ClamorInterface, NamesWhatIsWrongWithALevel) {
  const Context context = make_context();
  clamor_level level = 0;
  clamor_error error;
  EXPECT_EQ(clamor_open_level(context.get(), "/no/such/level.clamor", &level, &error),
            CLAMOR_ERROR_FILE);
  EXPECT_THAT(error.sentence, HasSubstr("/no/such/level.clamor"));

  // The application's bytes end early, or its callback fails: they stay the application's.
  std::string cut = bytes_of_room().substr(0, 1000);
  clamor_reader reader{};
  reader.bytes = sizeof(reader);
  reader.name = "hall in the archive";
  reader.size = cut.size();
  reader.user = &cut;
  reader.read = read_from;
  reader.release = [](void*) { ADD_FAILURE() << "released though it was not opened"; };
  EXPECT_EQ(clamor_open_level_with(context.get(), &reader, &level, &error), CLAMOR_ERROR_FILE);
  EXPECT_THAT(error.sentence, HasSubstr("hall in the archive"));
  reader.size = 2000;
  EXPECT_EQ(clamor_open_level_with(context.get(), &reader, &level, &error), CLAMOR_ERROR_FILE);
  reader.size = 0;
  EXPECT_EQ(clamor_open_level_with(context.get(), &reader, &level, &error), CLAMOR_ERROR_FILE);
}

TEST(ClamorInterface, RejectsHandlesThatAreStaleInventedOrForeign) {
  const Context context = make_context(), other = make_context();
  const clamor_level level = open_level(context);
  const clamor_listener listener = add_listener(context, level);
  const clamor_level foreign = open_level(other);
  const clamor_pose pose = pose_of(Listener(Vec3(2, 4, 1.6)));
  std::array<float, 32> block{};
  for (const uint64_t wrong : {uint64_t{0}, uint64_t{1}, ~uint64_t{0}, level, foreign}) {
    EXPECT_EQ(clamor_move_listener(context.get(), wrong, &pose), CLAMOR_ERROR_HANDLE);
    EXPECT_EQ(clamor_render(context.get(), wrong, block.data(), 16), CLAMOR_ERROR_HANDLE);
    EXPECT_EQ(clamor_destroy_listener(context.get(), wrong), CLAMOR_ERROR_HANDLE);
  }
  EXPECT_EQ(clamor_enter_level(context.get(), listener, foreign, nullptr), CLAMOR_ERROR_HANDLE);
  EXPECT_EQ(clamor_destroy_listener(context.get(), listener), CLAMOR_OK);
  EXPECT_EQ(clamor_render(context.get(), listener, block.data(), 16), CLAMOR_ERROR_HANDLE);
  const clamor_listener next = add_listener(context, level);
  EXPECT_NE(next, listener);
  EXPECT_EQ(clamor_move_listener(context.get(), listener, &pose), CLAMOR_ERROR_HANDLE);
}

TEST(ClamorInterface, RejectsArgumentsOutOfRange) {
  const Context context = make_context();
  const clamor_level level = open_level(context);
  const clamor_listener listener = add_listener(context, level);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  clamor_pose pose = pose_of(Listener(Vec3(2, 4, 1.6)));
  pose.position_m[1] = kNan;
  EXPECT_EQ(clamor_move_listener(context.get(), listener, &pose), CLAMOR_ERROR_ARGUMENT);
  pose = {{2, 4, 1.6}, {0, 0, 0, 0}};
  EXPECT_EQ(clamor_move_listener(context.get(), listener, &pose), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(clamor_render(context.get(), listener, nullptr, 16), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(clamor_update(context.get(), -1, nullptr), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(clamor_update(nullptr, 0, nullptr), CLAMOR_ERROR_ARGUMENT);
  const auto created = [&](const auto& change) {
    clamor_listener_options options = offline();
    change(options);
    clamor_listener handle = 0;
    return clamor_create_listener(context.get(), level, &options, &handle, nullptr);
  };
  using Options = clamor_listener_options;
  EXPECT_EQ(created([](Options& o) { o.bytes = 2; }), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(created([](Options& o) { o.output = 5; }), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(created([](Options& o) { o.rate_hz = 7999; }), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(created([](Options& o) { o.voices = 100'001; }), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(created([](Options& o) { o.gain = -1; }), CLAMOR_ERROR_ARGUMENT);
  EXPECT_EQ(created([](Options& o) {
              o.output = CLAMOR_OUTPUT_LOUDSPEAKERS;
              o.layout = "no such layout";
            }),
            CLAMOR_ERROR_FILE);
  clamor_listener_options options = offline();
  options.late = CLAMOR_LATE_DENSE, options.mixing = CLAMOR_MIXING_VOICES;
  clamor_listener handle = 0;
  clamor_error error;
  EXPECT_EQ(clamor_create_listener(context.get(), level, &options, &handle, &error),
            CLAMOR_ERROR_ARGUMENT);
  EXPECT_NE(std::string(error.sentence).find("dense late sound"), std::string::npos)
      << error.sentence;
  const Context with_thread = make_context(false);
  options = offline();
  EXPECT_EQ(clamor_create_listener(with_thread.get(), open_level(with_thread), &options, &handle,
                                   nullptr),
            CLAMOR_ERROR_STATE);
  EXPECT_EQ(clamor_update(with_thread.get(), 0, nullptr), CLAMOR_ERROR_STATE);
}

TEST(ClamorInterface, TakesStructuresOfOlderAndNewerVersions) {
  const Context context = make_context();
  const clamor_level level = open_level(context);
  struct Newer {
    clamor_level_info known;
    uint64_t more;
  } newer{};
  newer.known.bytes = sizeof(newer);
  newer.more = 7;
  EXPECT_EQ(clamor_get_level_info(context.get(), level, &newer.known), CLAMOR_OK);
  EXPECT_EQ(newer.known.emitters, 3u);
  EXPECT_EQ(newer.known.sounds, 3u);
  EXPECT_GT(newer.known.sources, 300u);
  EXPECT_EQ(newer.more, 0u);
  clamor_level_info older{};
  older.bytes = offsetof(clamor_level_info, sounds);
  older.sounds = 99;
  EXPECT_EQ(clamor_get_level_info(context.get(), level, &older), CLAMOR_OK);
  EXPECT_EQ(older.emitters, 3u);
  EXPECT_EQ(older.sounds, 99u) << "written behind the structure's end";

  struct NewerOptions {
    clamor_options known;
    uint32_t more;
  } options{};
  options.known.bytes = sizeof(options);
  clamor_context* made = nullptr;
  EXPECT_EQ(clamor_create(&options.known, &made, nullptr), CLAMOR_OK);
  clamor_destroy(made);
  options.more = 1;  // an option that this version does not know
  EXPECT_EQ(clamor_create(&options.known, &made, nullptr), CLAMOR_ERROR_ARGUMENT);
}

// The share of a tone in the power of a block, by the Goertzel sum.
double tone_share(std::span<const float> stereo, double frequency_hz, double rate_hz) {
  double cosine = 0, sine = 0, power = 0;
  const std::size_t frames = stereo.size() / 2;
  for (std::size_t i = 0; i < frames; ++i) {
    const double phase = 2 * std::numbers::pi * frequency_hz * static_cast<double>(i) / rate_hz;
    cosine += stereo[2 * i] * std::cos(phase);
    sine += stereo[2 * i] * std::sin(phase);
    power += static_cast<double>(stereo[2 * i]) * stereo[2 * i];
  }
  return 2 * (cosine * cosine + sine * sine) / (static_cast<double>(frames) * power);
}

TEST(ClamorInterface, CrossfadesIntoAnotherLevelWithoutAGapOrAClick) {
  const testing::TemporaryFile low_file(".clamor"), high_file(".clamor");
  const Context context = make_context();
  const clamor_level low = open_level(context, tone_level(low_file, 200));
  const clamor_level high = open_level(context, tone_level(high_file, 500));
  const clamor_listener listener = add_listener(context, low);
  const Walk standing = Walk::standing(Listener(Vec3(3, 4, 1.5)));
  std::vector<float> samples = heard(context, listener, standing, 24'000, 240);
  ASSERT_EQ(clamor_enter_level(context.get(), listener, high, nullptr), CLAMOR_OK);
  EXPECT_EQ(clamor_close_level(context.get(), low), CLAMOR_OK);
  const std::vector<float> after = heard(context, listener, standing, 24'000, 240);
  samples.insert(samples.end(), after.begin(), after.end());
  const std::span<const float> all(samples);
  EXPECT_GT(tone_share(all.subspan(24'000, 9'600), 200, 48'000), 0.99);
  EXPECT_GT(tone_share(all.subspan(72'000, 9'600), 500, 48'000), 0.99);

  // The steepest slope is that of the tones; a click would be steeper.
  double amplitude = 0, steepest = 0;
  for (std::size_t i = 24'002; i + 1 < samples.size(); i += 2) {
    amplitude = std::max(amplitude, std::abs(static_cast<double>(samples[i])));
    steepest = std::max(steepest, std::abs(static_cast<double>(samples[i]) - samples[i - 2]));
  }
  EXPECT_LT(steepest, 1.2 * amplitude * 2 * std::numbers::pi * 500 / 48'000);
  // There is no gap: each 5 ms, a period of the lower tone, have sound.
  for (std::size_t first = 24'000; first + 480 <= samples.size(); first += 480) {
    const auto part = all.subspan(first, 480);
    EXPECT_GT(*std::max_element(part.begin(), part.end()), 0.2 * amplitude) << first;
  }
}

TEST(ClamorInterface, KeepsAToneAtItsPitchAtAnyRate) {
  const testing::TemporaryFile file(".clamor");
  tone_level(file, 500);
  for (const uint32_t rate_hz : {8'000u, 44'100u, 192'000u}) {
    const Context context = make_context();
    clamor_listener_options options = offline();
    options.rate_hz = rate_hz;
    const clamor_listener listener =
        add_listener(context, open_level(context, file.path()), options);
    const Walk standing = Walk::standing(Listener(Vec3(3, 4, 1.5)));
    const auto samples = heard(context, listener, standing, rate_hz / 2, 128);
    EXPECT_GT(tone_share(std::span(samples).last(rate_hz / 2), 500, rate_hz), 0.99) << rate_hz;
  }
}

std::size_t threads_of_process() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return static_cast<std::size_t>(std::distance(begin(tasks), end(tasks)));
}

TEST(ClamorInterface, StartsNoThreadToPlayWhereTheCallerUpdates) {
  const Context context = make_context();
  const clamor_level level = open_level(context);
  const std::size_t before = threads_of_process();
  clamor_listener_options options = offline();
  options.offline = 0;
  const clamor_listener listener = add_listener(context, level, options);
  std::array<float, 960> block{};
  double energy = 0;
  for (int i = 0; i < 200; ++i) {
    ASSERT_EQ(clamor_update(context.get(), 0.01, nullptr), CLAMOR_OK);
    ASSERT_EQ(clamor_render(context.get(), listener, block.data(), 480), CLAMOR_OK);
    for (const float sample : block) energy += static_cast<double>(sample) * sample;
  }
  EXPECT_EQ(threads_of_process(), before);
  EXPECT_GT(energy, 0);
  clamor_listener_statistics statistics{};
  statistics.bytes = sizeof(statistics);
  ASSERT_EQ(clamor_get_listener_statistics(context.get(), listener, &statistics), CLAMOR_OK);
  EXPECT_EQ(statistics.failures, 0u);
  EXPECT_EQ(statistics.held_blocks, 0u);
  EXPECT_GT(statistics.sound_bytes, 0u);
}

// The emitter of gain 1 stands at (2, 3, 1.2); the reflections of the room come later.
TEST(ClamorInterface, MeasuresResponsesWhoseFirstArrivalIsTheDirectSound) {
  const Context context = make_context();
  const clamor_level level = open_level(context);
  const std::array<double, 6> places = {2, 5, 1.2, 4, 3, 1.2};
  constexpr uint64_t kFrames = 4'800;
  std::vector<float> samples(2 * kFrames);
  uint64_t whole = 0;
  ASSERT_EQ(clamor_measure_responses(context.get(), level, 0, places.data(), 2, samples.data(),
                                     kFrames, &whole, nullptr),
            CLAMOR_OK);
  EXPECT_GT(whole, kFrames);
  const double delay_frames = 2 / speed_of_sound_mps(Air{}) * kSampleRate_hz;
  for (int i = 0; i < 2; ++i) {
    const std::span response = std::span(samples).subspan(i * kFrames, kFrames);
    const auto before = response.first(static_cast<std::size_t>(delay_frames) - 40);
    EXPECT_LT(*std::max_element(before.begin(), before.end()), 0.01f);
    double sum = 0;  // of the pulse, between whole frames
    for (int k = -8; k <= 8; ++k)
      sum += response[static_cast<std::size_t>(std::lround(delay_frames) + k)];
    EXPECT_NEAR(sum, 0.5, 0.05);
  }
  clamor_error error;
  EXPECT_EQ(clamor_measure_responses(context.get(), level, 3, places.data(), 2, samples.data(),
                                     kFrames, nullptr, &error),
            CLAMOR_ERROR_ARGUMENT);
  EXPECT_THAT(error.sentence, HasSubstr("no such emitter"));
}

}  // namespace
}  // namespace clamor
