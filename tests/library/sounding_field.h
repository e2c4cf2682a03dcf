// sounding_field.h: a context with a free field and one listener, for tests of the game's own
// sounds.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "common/sample_rate.h"
#include "common/vec.h"
#include "runtime/clamor.h"
#include "tests/library/library_room.h"

namespace clamor::testing {

inline constexpr std::size_t kSecond = kSampleRate_hz;

inline std::vector<float> tone(double frequency_hz, std::size_t frames, float amplitude = 0.5f) {
  std::vector<float> samples(frames);
  for (std::size_t i = 0; i < frames; ++i)
    samples[i] = amplitude * static_cast<float>(std::sin(2 * std::numbers::pi * frequency_hz *
                                                         static_cast<double>(i) / kSampleRate_hz));
  return samples;
}

// A context with one offline listener at the origin.
struct Field {
  explicit Field(uint32_t output = CLAMOR_OUTPUT_RECEIVERS, uint32_t voices = 100) {
    clamor_listener_options options = offline();
    options.pose = {};
    options.output = output;
    options.voices = voices;
    options.reports_voices = 1;
    listener = add_listener(context, level, options);
  }

  clamor_sound add(const std::vector<float>& samples, bool loops = false) const {
    clamor_sound_options options{};
    options.bytes = sizeof(options);
    options.loops = loops;
    clamor_sound sound = 0;
    EXPECT_EQ(
        clamor_add_sound(context.get(), samples.data(), samples.size(), &options, &sound, nullptr),
        CLAMOR_OK);
    return sound;
  }
  static clamor_source_options at(clamor_sound sound, const Vec3& position_m) {
    clamor_source_options options{};
    options.bytes = sizeof(options);
    options.sound = sound;
    options.motion = {{position_m.x, position_m.y, position_m.z}, {}, {}};
    return options;
  }
  clamor_source add(const clamor_source_options& options) const {
    clamor_source source = 0;
    EXPECT_EQ(clamor_add_source(context.get(), &options, &source), CLAMOR_OK);
    return source;
  }

  // The first channel of what is heard; before_keyframe(time_s) precedes each keyframe and commit.
  std::vector<float> heard(std::size_t frames,
                           const std::function<void(double)>& before_keyframe = {}) {
    std::vector<float> left, block(2 * 480);
    while (left.size() < frames) {
      uint32_t wanted = 0;
      double time_s = 0;
      while (clamor_next_keyframe(context.get(), listener, &wanted, &time_s) == CLAMOR_OK &&
             wanted) {
        if (before_keyframe) before_keyframe(time_s);
        EXPECT_EQ(clamor_commit(context.get(), time_s), CLAMOR_OK);
        EXPECT_EQ(clamor_update(context.get(), 0, nullptr), CLAMOR_OK);
      }
      EXPECT_EQ(clamor_render(context.get(), listener, block.data(), 480), CLAMOR_OK);
      for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
    }
    left.resize(frames);
    return left;
  }

  std::vector<clamor_voice> voices() const {
    clamor_voices asked{};
    asked.bytes = sizeof(asked);
    std::vector<clamor_voice> voices(1000);
    asked.voices = voices.data();
    asked.capacity = 1000;
    EXPECT_EQ(clamor_get_voices(context.get(), listener, &asked), CLAMOR_OK);
    voices.resize(asked.count);
    return voices;
  }

  Context context = make_context();
  clamor_level level = open_level(context, silent_field());
  clamor_listener listener = 0;
};

inline double rms(std::span<const float> samples) {
  double sum = 0;
  for (const float sample : samples) sum += static_cast<double>(sample) * sample;
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

inline double rms_between(const std::vector<float>& samples, double from_s, double to_s) {
  const auto frame = [](double s) { return static_cast<std::size_t>(s * kSampleRate_hz); };
  return rms(std::span(samples).subspan(frame(from_s), frame(to_s) - frame(from_s)));
}

inline double db(double ratio) { return 20 * std::log10(ratio); }

// The frequency of a tone, from its zero crossings.
inline double frequency_hz(std::span<const float> samples) {
  double first = -1, last = -1, periods = -1;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (!(samples[i - 1] < 0 && samples[i] >= 0)) continue;
    last = static_cast<double>(i) - samples[i] / (samples[i] - samples[i - 1]);
    if (first < 0) first = last;
    ++periods;
  }
  return periods * kSampleRate_hz / (last - first);
}

}  // namespace clamor::testing
