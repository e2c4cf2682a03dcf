// clamor_sources_test.cpp: sounds, sources and groups of the C interface, in a free field.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "common/air.h"
#include "common/sample_rate.h"
#include "formats/audio/audio_file.h"
#include "runtime/clamor.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/world/world_sound.h"
#include "runtime/world/world_sources.h"
#include "tests/library/sounding_field.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

using testing::Context;
using testing::db;
using testing::Field;
using testing::frequency_hz;
using testing::kSecond;
using testing::make_context;
using testing::offline;
using testing::open_level;
using testing::rms;
using testing::rms_between;
using testing::silent_field;
using testing::tone;

// Oracle: the auralizer with the same sound as one of its own.
TEST(ClamorSources, AreHeardAsTheAuralizersOwnMovingSources) {
  const std::vector<float> samples = tone(500, kSecond / 2);
  const auto place = [](double t) { return Vec3{3 - 4 * t, 1, -5}; };
  for (const bool loops : {false, true}) {
    Field field;
    clamor_source source = 0;
    const clamor_sound sound = field.add(samples, loops);
    const std::vector<float> heard = field.heard(kSecond, [&](double t) {
      clamor_source_options options = Field::at(sound, place(t));
      options.motion.velocity_mps[0] = -4;
      if (source == 0) {
        source = field.add(options);
      } else {
        EXPECT_EQ(clamor_move_source(field.context.get(), source, &options.motion), CLAMOR_OK);
      }
    });

    AuralizerOptions options;
    options.voices = 100;
    options.wait_for_pages = true;
    options.moving.max_sources = 1;
    options.moving.signals = {{"tone", samples, loops}};
    options.moving.kinds = {{"tone", 3, {}}};
    const auto auralizer = *Auralizer::create(
        std::make_shared<const BakeFile>(std::move(*BakeFile::open(silent_field()))), options);
    MovingHandle handle;
    std::vector<float> expected, block(2 * 480);
    while (expected.size() < kSecond) {
      while (auralizer->wants_keyframe()) {
        const double t = auralizer->next_keyframe_time_s();
        MovingSource moved;
        moved.position_m = place(t);
        moved.velocity_mps = {-4, 0, 0};
        if (handle.generation == 0)
          handle = *auralizer->moving()->add(moved);
        else
          (void)auralizer->moving()->move(handle, moved.position_m, moved.velocity_mps);
        auralizer->moving()->commit(t);
        auralizer->make_keyframe({});
      }
      auralizer->mix(block);
      for (std::size_t f = 0; f < block.size(); f += 2) expected.push_back(block[f]);
    }
    EXPECT_GT(rms(expected), 0.01);
    EXPECT_EQ(heard, expected) << loops;
  }
}

TEST(ClamorSources, HaveDopplerWithoutTellingTheirVelocity) {
  Field field;
  const clamor_sound sound = field.add(tone(1000, kSecond), true);
  clamor_source source = 0;
  const std::vector<float> heard = field.heard(kSecond, [&](double t) {
    const clamor_source_options options = Field::at(sound, {0, 0, -60 + 30 * t});
    if (source == 0) source = field.add(options);
    EXPECT_EQ(clamor_move_source(field.context.get(), source, &options.motion), CLAMOR_OK);
  });
  const double c = speed_of_sound_mps(Air{});
  EXPECT_NEAR(frequency_hz(std::span(heard).subspan(kSecond / 2)), 1000 / (1 - 30 / c), 0.05);
}

// A loop does not tell how often it has been played, and no gain that is allowed is too much.
TEST(ClamorSources, ThatHavePlayedForDaysAreHeardAsThoseThatBegin) {
  const auto heard_after = [](double played_s) {
    Field field;
    auto source = field.at(field.add(tone(500, kSecond / 2), true), {0.1, 0, 0});
    source.gain = 1e6;
    source.played_s = played_s;
    field.add(source);
    return field.heard(kSecond / 4);
  };
  const auto a_minute = heard_after(60), eleven_days = heard_after(1e6);
  EXPECT_GT(rms(a_minute), 1e6);
  double largest = 0;
  for (std::size_t i = 0; i < a_minute.size(); ++i)
    largest = std::max(largest, std::abs(1.0 * a_minute[i] - eleven_days[i]));
  EXPECT_LT(largest, 1e-4 * rms(a_minute));
}

TEST(ClamorSources, AreReadFromFilesAndLevels) {
  const testing::TemporaryFile file(".flac");
  const auto flac = encode_flac(tone(500, kSecond / 4));
  ASSERT_TRUE(flac.ok());
  std::ofstream(file.path(), std::ios::binary)
      .write(reinterpret_cast<const char*>(flac->data()),
             static_cast<std::streamsize>(flac->size()));
  Field field;
  clamor_sound sound = 0, of_level = 0;
  ASSERT_EQ(clamor_read_sound(field.context.get(), file.path().c_str(), nullptr, &sound, nullptr),
            CLAMOR_OK);
  const clamor_level room = open_level(field.context);
  ASSERT_EQ(clamor_read_level_sound(field.context.get(), room, 1, &of_level, nullptr), CLAMOR_OK);
  EXPECT_EQ(clamor_read_level_sound(field.context.get(), room, 3, &of_level, nullptr),
            CLAMOR_ERROR_ARGUMENT);
  clamor_error error;
  EXPECT_EQ(clamor_read_sound(field.context.get(), "/no/such.flac", nullptr, &sound, &error),
            CLAMOR_ERROR_FILE);
  EXPECT_NE(std::string(error.sentence).find("/no/such.flac"), std::string::npos);
  field.add(Field::at(sound, {0, 0, -2}));
  const std::vector<float> first = field.heard(kSecond / 2);
  EXPECT_NEAR(frequency_hz(std::span(first).subspan(2'000, 8'000)), 500, 0.1);
  field.add(Field::at(of_level, {0, 0, -2}));
  const std::vector<float> second = field.heard(kSecond / 2);
  EXPECT_NEAR(frequency_hz(std::span(second).subspan(12'000, 8'000)), 997, 0.1);
}

TEST(ClamorSources, OfAGroupHaveItsGainAndStandStillWhileItIsPaused) {
  Field field;
  clamor_group_options bus{};
  bus.bytes = sizeof(bus);
  clamor_group group = 0;
  ASSERT_EQ(clamor_add_group(field.context.get(), &bus, &group), CLAMOR_OK);
  clamor_source_options options = Field::at(field.add(tone(500, kSecond)), {0, 0, -2});
  options.group = group;
  field.add(options);
  // Full for 0.3 s, -12 dB to 0.6 s, muted to 0.9 s, full to 1.2 s, and paused to 1.8 s: the second
  // of sound is over at 1.6 s.
  const std::vector<float> heard = field.heard(2 * kSecond, [&](double t) {
    bus.has_gain = t > 0.3 && t < 0.59;
    bus.gain = 0.25;
    bus.is_muted = t > 0.59 && t < 0.89;
    bus.is_paused = t > 0.99 - 0.3 && t < 1.29;
    EXPECT_EQ(clamor_change_group(field.context.get(), group, &bus), CLAMOR_OK);
  });
  const double level = rms_between(heard, 0.05, 0.28);
  EXPECT_NEAR(db(rms_between(heard, 0.4, 0.55) / level), -12.04, 0.05);
  EXPECT_LT(rms_between(heard, 0.85, 1.25), 1e-5);
  // It was paused after 0.7 s, and has 0.3 s left from 1.3 s on.
  EXPECT_NEAR(db(rms_between(heard, 1.42, 1.58) / level), 0, 0.1);
  EXPECT_LT(rms_between(heard, 1.65, 2), 1e-5);
}

TEST(ClamorSources, OfAGroupTakeNoMoreThanItsShareOfTheVoices) {
  Field field(CLAMOR_OUTPUT_RECEIVERS, 40);
  clamor_group_options bus{};
  bus.bytes = sizeof(bus);
  bus.max_voices = 0.25;
  clamor_group group = 0;
  ASSERT_EQ(clamor_add_group(field.context.get(), &bus, &group), CLAMOR_OK);
  const clamor_sound steps = field.add(tone(500, kSecond), true),
                     speech = field.add(tone(700, kSecond), true);
  for (int i = 0; i < 60; ++i) {
    clamor_source_options options = Field::at(steps, {0.1 * i - 3, 0, -3});
    options.group = group;
    field.add(options);
  }
  for (int i = 0; i < 5; ++i) field.add(Field::at(speech, {0.1 * i, 0, -10}));
  field.heard(kSecond / 2);
  std::size_t of_group = 0, others = 0;
  for (const clamor_voice& voice : field.voices()) {
    of_group += voice.sound == steps;
    others += voice.sound == speech;
  }
  EXPECT_EQ(of_group, 10u);
  EXPECT_EQ(others, 5u);
}

TEST(ClamorSources, AreToldWithTheirDirectionDelayAndGains) {
  Field field;
  const clamor_sound sound = field.add(tone(500, kSecond), true);
  clamor_source_options options = Field::at(sound, {3, 0, -4});
  options.gain = 2;
  field.add(options);
  field.heard(kSecond / 5);
  const std::vector<clamor_voice> voices = field.voices();
  ASSERT_EQ(voices.size(), 1u);
  EXPECT_EQ(voices[0].sound, sound);
  EXPECT_EQ(voices[0].level_sound, 0xffffffffu);
  EXPECT_NEAR(voices[0].direction[0], 0.6, 0.02);  // receivers stand beside the centre
  EXPECT_NEAR(voices[0].direction[1], 0, 1e-3);
  EXPECT_NEAR(voices[0].direction[2], -0.8, 0.02);
  EXPECT_NEAR(voices[0].delay_s, 5 / speed_of_sound_mps(Air{}), 1e-4);
  for (const float gain : voices[0].band_gains) EXPECT_NEAR(db(gain / (2.0 / 5)), 0, 0.6);  // air
}

TEST(ClamorSources, AreToldWithTheirSoundWhileTheyFadeOutAfterItsRemoval) {
  Field field;
  const clamor_sound sound = field.add(tone(500, kSecond), true);
  field.add(Field::at(sound, {3, 0, -4}));
  field.heard(kSecond / 5);
  EXPECT_EQ(clamor_remove_sound(field.context.get(), sound), CLAMOR_OK);
  std::size_t told = 0;
  for (int i = 0; i < 10; ++i) {
    field.heard(960);
    for (const clamor_voice& voice : field.voices()) {
      EXPECT_EQ(voice.sound, sound);
      ++told;
    }
  }
  EXPECT_GT(told, 0u);
  EXPECT_TRUE(field.voices().empty());
}

TEST(ClamorSources, EndWithTheirSoundTheirHandleAndTheirLevel) {
  Field field;
  const clamor_sound sound = field.add(tone(500, 4'800));
  clamor_source_options shot = Field::at(sound, {0, 0, -2}), elsewhere = shot;
  shot.ends_with_sound = 1;
  elsewhere.level = open_level(field.context);
  elsewhere.gain = 1000;
  const clamor_source once = field.add(shot), unheard = field.add(elsewhere);
  EXPECT_LT(rms(field.heard(kSecond / 4)), 1);
  EXPECT_EQ(clamor_remove_source(field.context.get(), unheard), CLAMOR_OK);
  EXPECT_EQ(clamor_remove_source(field.context.get(), unheard), CLAMOR_ERROR_HANDLE);
  const clamor_source kept = field.add(Field::at(sound, {0, 0, -2}));
  EXPECT_EQ(clamor_remove_sound(field.context.get(), sound), CLAMOR_OK);
  EXPECT_EQ(clamor_remove_source(field.context.get(), kept), CLAMOR_ERROR_HANDLE);
  EXPECT_EQ(clamor_remove_source(field.context.get(), once), CLAMOR_ERROR_HANDLE);
  EXPECT_LT(rms(field.heard(kSecond / 2)), 1e-12);
}

// Offline listeners are rendered at any speed, so that their clock decides.
TEST(ClamorSources, WhoseHandleEndsWithTheirSoundEndOnceItHasTravelled) {
  Field field;
  clamor_source_options shot = Field::at(field.add(tone(500, 4'800)), {0, 0, -2});
  shot.ends_with_sound = 1;
  const clamor_source source = field.add(shot);
  const auto exists_at = [&](double time_s) {
    EXPECT_EQ(clamor_commit(field.context.get(), time_s), CLAMOR_OK);
    return clamor_move_source(field.context.get(), source, &shot.motion) == CLAMOR_OK;
  };
  EXPECT_TRUE(exists_at(0.02));
  EXPECT_TRUE(exists_at(1));
  EXPECT_FALSE(exists_at(4));
}

// Without offline listeners commits are for no time of theirs.
TEST(ClamorSources, WhoseHandleEndsWithTheirSoundEndInRealTimeToo) {
  WorldSources sources(1, 1, 0);
  WorldSource shot;
  shot.sound =
      sources.add(std::make_shared<WorldSound>(Signal{"shot", std::vector<float>(4'800), false}));
  shot.ends_with_sound = true;
  const std::uint64_t source = sources.add(shot);
  const auto exists_at = [&](double real_s) {
    sources.commit({real_s, 0});
    return sources.move(source, {});
  };
  EXPECT_TRUE(exists_at(1000));
  EXPECT_TRUE(exists_at(1002));
  EXPECT_FALSE(exists_at(1004));
}

// 120 dB of the source and 120 dB of its group make 120 dB.
TEST(ClamorSources, OfAGroupAreHeardWithTheLargestGainsOfBoth) {
  Field field;
  clamor_group_options bus{};
  bus.bytes = sizeof(bus);
  bus.has_gain = 1;
  bus.gain = 1e6;
  clamor_source_options options = Field::at(field.add(tone(500, kSecond, 1e-6f), true), {0, 0, -2});
  ASSERT_EQ(clamor_add_group(field.context.get(), &bus, &options.group), CLAMOR_OK);
  options.gain = 1e6;
  field.add(options);
  EXPECT_NEAR(db(rms_between(field.heard(kSecond), 0.5, 1) * std::sqrt(2.0)), -6, 0.6);
}

TEST(ClamorSources, AreAsManyAsTheContextAllows) {
  clamor_options options{};
  options.bytes = sizeof(options);
  options.max_sources = 2;
  options.max_sounds = 3;
  clamor_context* made = nullptr;
  ASSERT_EQ(clamor_create(&options, &made, nullptr), CLAMOR_OK);
  const Context context(made);
  const std::vector<float> samples = tone(500, 480);
  clamor_sound sound = 0;
  const auto add_sound = [&] {
    return clamor_add_sound(made, samples.data(), samples.size(), nullptr, &sound, nullptr);
  };
  for (int i = 0; i < 3; ++i) EXPECT_EQ(add_sound(), CLAMOR_OK);
  EXPECT_EQ(clamor_remove_sound(made, sound), CLAMOR_OK);
  EXPECT_EQ(add_sound(), CLAMOR_OK);
  EXPECT_EQ(add_sound(), CLAMOR_ERROR_FULL);
  const clamor_source_options source = Field::at(sound, {0, 0, -1});
  clamor_source added = 0;
  for (int i = 0; i < 2; ++i) EXPECT_EQ(clamor_add_source(made, &source, &added), CLAMOR_OK);
  EXPECT_EQ(clamor_add_source(made, &source, &added), CLAMOR_ERROR_FULL);
}

TEST(ClamorSources, RefuseWrongArguments) {
  Field field;
  clamor_context* const context = field.context.get();
  const clamor_sound sound = field.add(tone(500, 480));
  clamor_source source = 0;
  clamor_source_options options = Field::at(sound, {0, 0, NAN});
  EXPECT_EQ(clamor_add_source(context, &options, &source), CLAMOR_ERROR_ARGUMENT);
  options = Field::at(sound + 1, {0, 0, 0});
  EXPECT_EQ(clamor_add_source(context, &options, &source), CLAMOR_ERROR_HANDLE);
  options = Field::at(sound, {0, 0, 0});
  options.directivity[3] = -1;
  EXPECT_EQ(clamor_add_source(context, &options, &source), CLAMOR_ERROR_ARGUMENT);
  const Context other = make_context();
  options = Field::at(sound, {0, 0, 0});
  EXPECT_EQ(clamor_add_source(other.get(), &options, &source), CLAMOR_ERROR_HANDLE);
  EXPECT_EQ(clamor_commit(context, NAN), CLAMOR_ERROR_ARGUMENT);
  const std::vector<float> too_loud = {0, 2e6f};
  clamor_sound refused = 0;
  EXPECT_EQ(clamor_add_sound(context, too_loud.data(), 2, nullptr, &refused, nullptr),
            CLAMOR_ERROR_ARGUMENT);
  float sample = 0;
  uint32_t taken = 7;
  EXPECT_EQ(clamor_write_stream(context, sound, &sample, 1, &taken), CLAMOR_ERROR_STATE);
  EXPECT_EQ(taken, 7u) << "after an error results are as they were";
  EXPECT_EQ(clamor_write_stream(context, 77, &sample, 1, nullptr), CLAMOR_ERROR_HANDLE);
}

}  // namespace
}  // namespace clamor
