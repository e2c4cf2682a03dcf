// clamor_streams_test.cpp: sources of the C interface that play a stream, in a free field.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "common/sample_rate.h"
#include "runtime/clamor.h"
#include "tests/library/sounding_field.h"

namespace clamor {
namespace {

using testing::db;
using testing::Field;
using testing::frequency_hz;
using testing::kSecond;
using testing::rms;
using testing::rms_between;
using testing::tone;

// A stream arrives in pieces, and is prepared in pieces; a sound is prepared whole.
TEST(ClamorSources, StreamsSoundLikeTheSameSoundInMemory) {
  std::vector<float> samples(kSecond);
  for (std::size_t i = 0; i < samples.size(); ++i)  // noise of all frequencies
    samples[i] =
        static_cast<float>(std::sin(1e-4 * static_cast<double>(i * i % 99'991) * 0.37)) / 4;
  struct Player {
    const std::vector<float>& samples;
    std::size_t played = 0;
  } player{samples};
  clamor_stream stream{};
  stream.bytes = sizeof(stream);
  stream.user = &player;
  stream.pull = [](void* user, float* into, uint32_t frames) -> uint32_t {
    auto& from = *static_cast<Player*>(user);
    const std::size_t count = std::min<std::size_t>(frames, from.samples.size() - from.played);
    std::copy_n(from.samples.begin() + static_cast<std::ptrdiff_t>(from.played), count, into);
    from.played += count;
    return static_cast<uint32_t>(count);
  };
  // One after the other, because reading a head takes a second.
  Field field(CLAMOR_OUTPUT_BINAURAL);
  clamor_sound streamed = 0;
  ASSERT_EQ(clamor_add_stream(field.context.get(), &stream, &streamed, nullptr), CLAMOR_OK);
  const clamor_sound whole = field.add(samples);
  clamor_source first = 0, second = 0;
  const std::vector<float> heard = field.heard(4 * kSecond, [&](double t) {
    if (first == 0) first = field.add(Field::at(whole, {2, 0, -6}));
    if (second == 0 && t > 1.99) second = field.add(Field::at(streamed, {2, 0, -6}));
  });
  const std::span expected(heard.data(), 3 * kSecond / 2),
      got(&heard[2 * kSecond], 3 * kSecond / 2);
  EXPECT_GT(rms(expected), 0.005);
  std::vector<float> difference(expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) difference[i] = got[i] - expected[i];
  // Delays are floats, which 2 s rounds to 1e-7 s.
  EXPECT_LT(db(rms(difference) / rms(expected)), -60);
}

TEST(ClamorSources, StreamsThatAreWrittenAreHeardOnceAndMissingSamplesAreSilence) {
  Field field;
  clamor_stream stream{};
  stream.bytes = sizeof(stream);
  stream.rate_hz = 24'000;
  clamor_sound sound = 0;
  ASSERT_EQ(clamor_add_stream(field.context.get(), &stream, &sound, nullptr), CLAMOR_OK);
  const std::vector<float> samples = tone(1000, 20'000);  // at 24 kHz: 2 kHz as 1 kHz
  uint32_t taken = 0;
  ASSERT_EQ(clamor_write_stream(field.context.get(), sound, samples.data(), 20'000, &taken),
            CLAMOR_OK);
  EXPECT_EQ(taken, 20'000u);
  ASSERT_EQ(clamor_write_stream(field.context.get(), sound, samples.data(), 20'000, &taken),
            CLAMOR_OK);
  EXPECT_EQ(taken, 4'000u) << "the buffer is a second long";
  field.add(Field::at(sound, {0, 0, -2}));
  const std::vector<float> heard = field.heard(2 * kSecond);
  EXPECT_NEAR(frequency_hz(std::span(heard).subspan(kSecond / 4, kSecond / 2)), 500, 0.05);
  EXPECT_NEAR(rms_between(heard, 0.25, 0.75), 0.25 / std::sqrt(2.0), 0.001);
  EXPECT_LT(rms_between(heard, 1.5, 2), 1e-6);
}

TEST(ClamorSources, OfAStreamDoNotReadItWhileTheirGroupIsPausedOrAfterTheyEnd) {
  Field field;
  std::size_t pulled = 0;
  clamor_stream stream{};
  stream.bytes = sizeof(stream);
  stream.user = &pulled;
  stream.pull = [](void* user, float* into, uint32_t frames) -> uint32_t {
    std::fill_n(into, frames, 0.5f);
    *static_cast<std::size_t*>(user) += frames;
    return frames;
  };
  clamor_sound sound = 0;
  ASSERT_EQ(clamor_add_stream(field.context.get(), &stream, &sound, nullptr), CLAMOR_OK);
  clamor_group_options bus{};
  bus.bytes = sizeof(bus);
  clamor_group group = 0;
  ASSERT_EQ(clamor_add_group(field.context.get(), &bus, &group), CLAMOR_OK);
  clamor_source_options options = Field::at(sound, {0, 0, -2});
  options.group = group;
  field.heard(kSecond / 4);
  EXPECT_EQ(pulled, 0u);
  const clamor_source source = field.add(options);
  const auto pulled_in = [&](std::size_t frames) {
    const std::size_t before = pulled;
    field.heard(frames);
    return pulled - before;
  };
  pulled_in(kSecond / 4);
  EXPECT_NEAR(static_cast<double>(pulled_in(kSecond)), kSecond, 2'000);
  bus.is_paused = 1;
  EXPECT_EQ(clamor_change_group(field.context.get(), group, &bus), CLAMOR_OK);
  pulled_in(kSecond / 4);  // fades out
  EXPECT_EQ(pulled_in(kSecond), 0u);
  bus.is_paused = 0;
  EXPECT_EQ(clamor_change_group(field.context.get(), group, &bus), CLAMOR_OK);
  pulled_in(kSecond / 4);
  const std::size_t before = pulled;
  EXPECT_GT(rms(field.heard(kSecond / 2)), 0.01);
  EXPECT_NEAR(static_cast<double>(pulled - before), kSecond / 2, 2'000);
  EXPECT_EQ(clamor_remove_source(field.context.get(), source), CLAMOR_OK);
  pulled_in(kSecond / 4);
  EXPECT_EQ(pulled_in(kSecond), 0u);
}

// What a stream uses is the application's again once it has been released.
TEST(ClamorSources, ReleaseTheirStreamsOnce) {
  std::vector<int> released;
  struct Used {
    std::vector<int>& released;
    int number;
  } removed{released, 1}, kept{released, 2}, refused{released, 3};
  clamor_stream stream{};
  stream.bytes = sizeof(stream);
  stream.pull = [](void*, float*, uint32_t) -> uint32_t { return 0; };
  stream.release = [](void* user) {
    const auto& used = *static_cast<Used*>(user);
    used.released.push_back(used.number);
  };
  {
    Field field;
    const auto add = [&](Used& used, uint32_t rate_hz) {
      stream.user = &used;
      stream.rate_hz = rate_hz;
      clamor_sound sound = 0;
      (void)clamor_add_stream(field.context.get(), &stream, &sound, nullptr);
      return sound;
    };
    const clamor_sound sound = add(removed, 48'000);
    field.add(Field::at(add(kept, 48'000), {0, 0, -2}));
    field.add(Field::at(sound, {0, 0, -2}));
    EXPECT_EQ(add(refused, 1), 0u);
    field.heard(kSecond / 4);
    EXPECT_EQ(clamor_remove_sound(field.context.get(), sound), CLAMOR_OK);
    EXPECT_TRUE(released.empty());
    field.heard(kSecond / 4);
    EXPECT_EQ(released, std::vector<int>{1});
  }
  EXPECT_EQ(released, (std::vector<int>{1, 2}));
}

}  // namespace
}  // namespace clamor
