// clamor_reverberation_test.cpp: the reverberation of sources in the C interface, in a room with
// probes.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "common/sample_rate.h"
#include "formats/bake_file/bake_file.h"
#include "runtime/clamor.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/sampling/moving_sources.h"
#include "tests/library/library_room.h"
#include "tests/library/listened_room.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

using testing::largest_difference;
using testing::peak;

constexpr Vec3 kSource_m{5, 1.5, 7}, kEar_m{2, 1.6, 6};
constexpr std::size_t kFrames = 12'000;

// A room with one source, which begins with the first commit.
struct ReverberantRoom : testing::ListenedRoom {
  ReverberantRoom() : ReverberantRoom(testing::sine(500).samples) {}
  explicit ReverberantRoom(const std::vector<float>& samples)
      : ListenedRoom(testing::rooms_with_door()) {
    const clamor_pose pose{{kEar_m.x, kEar_m.y, kEar_m.z}, {0, 0, 0, 1}};
    EXPECT_EQ(clamor_move_listener(context.get(), listener, &pose), CLAMOR_OK);
    clamor_sound_options looping{};
    looping.bytes = sizeof(looping);
    looping.loops = 1;
    EXPECT_EQ(
        clamor_add_sound(context.get(), samples.data(), samples.size(), &looping, &sound, nullptr),
        CLAMOR_OK);
  }

  clamor_source_options options() const {
    clamor_source_options made{};
    made.bytes = sizeof(made);
    made.sound = sound;
    made.motion = {{kSource_m.x, kSource_m.y, kSource_m.z}, {}, {}};
    return made;
  }
  clamor_source_options options(double reverberation) const {
    clamor_source_options made = options();
    made.has_reverberation = 1;
    made.reverberation = reverberation;
    return made;
  }
  clamor_source add(const clamor_source_options& chosen) const {
    clamor_source source = 0;
    EXPECT_EQ(clamor_add_source(context.get(), &chosen, &source), CLAMOR_OK);
    return source;
  }

  // The next quarter of a second of the first channel; before_keyframe() precedes each commit.
  std::vector<float> heard(const std::function<void()>& before_keyframe = {}) const {
    std::vector<float> left, block(2 * 480);
    while (left.size() < kFrames) {
      std::uint32_t wanted = 0;
      double time_s = 0;
      while (clamor_next_keyframe(context.get(), listener, &wanted, &time_s) == CLAMOR_OK &&
             wanted != 0) {
        if (before_keyframe) before_keyframe();
        EXPECT_EQ(clamor_commit(context.get(), time_s), CLAMOR_OK);
        EXPECT_EQ(clamor_update(context.get(), 0, nullptr), CLAMOR_OK);
      }
      EXPECT_EQ(clamor_render(context.get(), listener, block.data(), 480), CLAMOR_OK);
      for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
    }
    return left;
  }

  clamor_sound sound = 0;
};

double power(const std::vector<float>& samples) {
  double sum = 0;
  for (const float sample : samples) sum += static_cast<double>(sample) * sample;
  return sum / static_cast<double>(samples.size());
}

// The first quarter of a second, rendered at its first use.
const std::vector<float>& with_reverberation(double reverberation) {
  static std::map<double, std::vector<float>> rendered;
  std::vector<float>& heard = rendered[reverberation];
  if (heard.empty()) {
    const ReverberantRoom room;
    room.add(room.options(reverberation));
    heard = room.heard();
  }
  return heard;
}

// Oracle: the auralizer with the same source as one of its own.
TEST(ClamorReverberation, IsThatOfTheAuralizersMovingSources_NoAsan) {
  for (const float reverberation : {0.0f, 0.25f, 1.0f}) {
    AuralizerOptions options;
    options.voices = 100'000;
    options.wait_for_pages = true;
    options.moving.max_sources = 1;
    options.moving.kinds = {{"sine", 0, {}}};
    auto sine = testing::sine(500);
    sine.loop = true;
    options.moving.signals = {sine};
    const auto auralizer = *Auralizer::create(
        std::make_shared<const BakeFile>(std::move(*BakeFile::open(testing::rooms_with_door()))),
        options);
    MovingSource source;
    source.position_m = kSource_m;
    source.reverberation = reverberation;
    ASSERT_TRUE(auralizer->moving()->add(source).ok());
    std::vector<float> expected, block(2 * 480);
    while (expected.size() < kFrames) {
      while (auralizer->wants_keyframe()) {
        auralizer->moving()->commit(auralizer->next_keyframe_time_s());
        auralizer->make_keyframe({kEar_m, 0, 0});
      }
      auralizer->mix(block);
      for (std::size_t f = 0; f < block.size(); f += 2) expected.push_back(block[f]);
    }
    EXPECT_GT(peak(expected), 0.01);
    EXPECT_EQ(with_reverberation(reverberation), expected) << reverberation;
  }
}

// Closed form: all reflections are heard, so amplitudes add.
TEST(ClamorReverberation, ScalesTheAmplitudeOfReflectionsAlone_NoAsan) {
  const auto direct = with_reverberation(0), whole = with_reverberation(1),
             half = with_reverberation(0.5);
  EXPECT_GT(largest_difference(whole, direct), 0.1 * peak(direct));
  std::vector<float> mean = direct;
  for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = 0.5f * (direct[i] + whole[i]);
  EXPECT_LT(largest_difference(half, mean), 1e-4 * peak(whole));
}

TEST(ClamorReverberation, IsOneUnlessItIsGiven_NoAsan) {
  const auto whole = with_reverberation(1);
  const ReverberantRoom room, of_older_program;
  clamor_source_options without = room.options();
  without.reverberation = 0.1;  // has no effect without has_reverberation
  room.add(without);
  EXPECT_EQ(room.heard(), whole);
  clamor_source_options shorter = of_older_program.options(0);
  shorter.bytes = offsetof(clamor_source_options, has_reverberation);
  of_older_program.add(shorter);
  EXPECT_EQ(of_older_program.heard(), whole);
}

TEST(ClamorReverberation, ChangesWithTheNextCommitAndWithoutAClick_NoAsan) {
  const ReverberantRoom room, dry_room;
  const clamor_source source = room.add(room.options(1));
  dry_room.add(dry_room.options(0));
  (void)room.heard();
  (void)dry_room.heard();
  const clamor_source_options dry = room.options(0);
  ASSERT_EQ(clamor_change_source(room.context.get(), source, &dry), CLAMOR_OK);
  const auto changing = room.heard();
  (void)dry_room.heard();
  EXPECT_LT(largest_difference(room.heard(), dry_room.heard()), 1e-4 * peak(changing));
  // A sine of 500 Hz turns by 0.065 a frame; a click would be a step.
  double step = 0;
  for (std::size_t i = 1; i < changing.size(); ++i)
    step = std::max(step, std::abs(1.0 * changing[i] - changing[i - 1]));
  EXPECT_LT(step, 0.08 * peak(changing));
}

// Reflections of a sine may cancel each other while it plays; those of noise do not.
TEST(ClamorReverberation, DiesAwayWhenItsSourceIsRemoved_NoAsan) {
  std::vector<float> noise;
  for (std::uint32_t i = 0; i < kSampleRate_hz; ++i)
    noise.push_back(0.1f * static_cast<float>(unit(philox(1, {i, 0, 0, 0})[0]) - 0.5));
  const ReverberantRoom room(noise);
  const clamor_source source = room.add(room.options());
  room.heard();
  double before = power(room.heard());
  EXPECT_EQ(clamor_remove_source(room.context.get(), source), CLAMOR_OK);
  for (int quarter = 0; quarter < 4; ++quarter) {
    const double now = power(room.heard());
    EXPECT_GT(now, 0);
    EXPECT_LT(now, before);
    before = now;
  }
  for (int quarter = 0; quarter < 20; ++quarter) room.heard();
  EXPECT_EQ(peak(room.heard()), 0);
}

// The place of a sound goes to the next one, which no source plays.
TEST(ClamorReverberation, EndsWithItsSound_NoAsan) {
  const ReverberantRoom room;
  room.add(room.options());
  room.heard();
  EXPECT_GT(peak(room.heard()), 0.01);
  EXPECT_EQ(clamor_remove_sound(room.context.get(), room.sound), CLAMOR_OK);
  const auto samples = testing::sine(700).samples;
  clamor_sound_options looping{};
  looping.bytes = sizeof(looping);
  looping.loops = 1;
  clamor_sound next = 0;
  EXPECT_EQ(clamor_add_sound(room.context.get(), samples.data(), samples.size(), &looping, &next,
                             nullptr),
            CLAMOR_OK);
  room.heard();
  room.heard();  // filters of the bands die away as well
  for (int quarter = 0; quarter < 4; ++quarter) EXPECT_LT(peak(room.heard()), 1e-9);
}

// Another source takes the place of one that dies away, with a sound of its own.
TEST(ClamorReverberation, KeepsItsSoundWhenAnotherSourceIsAdded_NoAsan) {
  const ReverberantRoom alone, beside;
  for (const ReverberantRoom* const room : {&alone, &beside}) {
    const clamor_source source = room->add(room->options());
    room->heard();
    EXPECT_EQ(clamor_remove_source(room->context.get(), source), CLAMOR_OK);
    room->heard();
  }
  std::vector<float> silence(4800);
  clamor_source_options silent = beside.options();
  EXPECT_EQ(clamor_add_sound(beside.context.get(), silence.data(), silence.size(), nullptr,
                             &silent.sound, nullptr),
            CLAMOR_OK);
  beside.add(silent);
  const auto expected = alone.heard();
  EXPECT_GT(peak(expected), 0.001);
  EXPECT_LT(largest_difference(beside.heard(), expected), 1e-6);
}

TEST(ClamorReverberation, IsRefusedOutOfRange_NoAsan) {
  const ReverberantRoom room;
  const clamor_source source = room.add(room.options(1));
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double hostile : {std::nan(""), kInfinity, -kInfinity, -1e-300, -1.0, 100.1, 1e300}) {
    const clamor_source_options options = room.options(hostile);
    clamor_source refused = 77;
    EXPECT_EQ(clamor_add_source(room.context.get(), &options, &refused), CLAMOR_ERROR_ARGUMENT)
        << hostile;
    EXPECT_EQ(refused, 77u);
    EXPECT_EQ(clamor_change_source(room.context.get(), source, &options), CLAMOR_ERROR_ARGUMENT)
        << hostile;
  }
  EXPECT_EQ(room.heard(), with_reverberation(1));  // the source is as it was
}

TEST(ClamorReverberation, IsFiniteWithTheLargestNumbersThatAreAllowed_NoAsan) {
  const ReverberantRoom room;
  clamor_source_options loudest = room.options(100);
  loudest.gain = 1e6;
  room.add(loudest);
  const auto heard = room.heard();
  for (const float sample : heard) ASSERT_TRUE(std::isfinite(sample));
  EXPECT_GT(peak(heard), 1e6 * peak(with_reverberation(1)));
}

}  // namespace
}  // namespace clamor
