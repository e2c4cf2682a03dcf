// auralizer_reception_test.cpp: directional receivers and output formats, up to the samples.
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/hrtf/hrtf.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/mixing/output_format.h"
#include "runtime/output/loudness_meter.h"
#include "tests/baked_room.h"

namespace clamor {
namespace {

constexpr double kRadPerDegree = std::numbers::pi / 180;

double channel_level_db(const std::vector<float>& interleaved, std::size_t channel) {
  double sum = 0;
  for (std::size_t i = channel; i < interleaved.size(); i += kEars)
    sum += static_cast<double>(interleaved[i]) * interleaved[i];
  return 10 * std::log10(sum / (static_cast<double>(interleaved.size()) / kEars));
}

Vec3 at(double to_the_left_deg) {
  const double a = to_the_left_deg * kRadPerDegree;
  return 10.0 * Vec3(-std::sin(a), 0, -std::cos(a));
}

// A sine in a free field, 10 m away, at an angle to the left.
std::vector<float> heard_from(double to_the_left_deg, const std::string& receivers) {
  AuralizerInput input;
  input.signals = {testing::sine(440)};
  input.emitters.resize(1);
  input.materials.resize(1);
  Source& source = input.sources.emplace_back();
  source.is_emitter = true;
  source.position_m = Vec3f(at(to_the_left_deg));
  source.power = same_in_all_bands(1);
  source.u = 0.5f;
  AuralizerOptions options;
  options.visibility = false;
  options.output = *OutputFormat::from_options(false, "", false, receivers);
  const auto auralizer = Auralizer::create(input, options);
  EXPECT_TRUE(auralizer.ok());
  while ((*auralizer)->wants_keyframe()) (*auralizer)->make_keyframe(Listener{});
  std::vector<float> block(2 * 4800), all;
  for (int i = 0; i < 5; ++i) {
    (*auralizer)->mix(block);
    if (i > 0) all.insert(all.end(), block.begin(), block.end());
    while ((*auralizer)->wants_keyframe()) (*auralizer)->make_keyframe(Listener{});
  }
  return all;
}

TEST(Reception, ReachesTheOutput) {
  for (const double angle_deg : {-150.0, -55.0, -20.0, 0.0, 30.0, 90.0}) {
    const auto omni = heard_from(angle_deg, "omni"), pair = heard_from(angle_deg, "ortf");
    for (std::size_t e = 0; e < kEars; ++e) {
      const double side = e == 0 ? -1 : 1;
      const Vec3 to_source_m = at(angle_deg) - Vec3(side * 0.5 * kEarDistance_m, 0, 0);
      const double off_axis =
          std::acos(dot(normalize(to_source_m), Vec3(side * std::sin(55 * kRadPerDegree), 0,
                                                     -std::cos(55 * kRadPerDegree))));
      EXPECT_NEAR(
          channel_level_db(pair, e) - channel_level_db(omni, e),
          // A cardioid receives a third of the power of a diffuse field; the output compensates.
          20 * std::log10((1 + std::cos(off_axis)) / 2) + 10 * std::log10(3), 0.1)
          << angle_deg << " degrees, ear " << e;
    }
  }
}

// Noise from 64 directions of equal solid angle. Directions with the same signal play it with
// different delays, so all are uncorrelated.
AuralizerInput diffuse_field() {
  constexpr std::uint32_t kDirections = 64, kSignals = 8;
  AuralizerInput input;
  input.materials.resize(1);
  for (std::uint32_t i = 0; i < kSignals; ++i) {
    Signal& signal = input.signals.emplace_back();
    for (std::uint32_t n = 0; n < kSampleRate_hz / 2; ++n)
      signal.samples.push_back(0.1f *
                               (2 * static_cast<float>(unit(philox(i, {n, 0, 0, 0})[0])) - 1));
  }
  for (std::uint32_t i = 0; i < kDirections; ++i) {
    Emitter& emitter = input.emitters.emplace_back();
    emitter.signal = i % kSignals;
    const double y = 1 - (2 * i + 1.0) / kDirections, radius = std::sqrt(1 - y * y);
    const double turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
    Source& source = input.sources.emplace_back();
    source.is_emitter = true;
    source.emitter = i;
    source.delay_s = 0.06f * static_cast<float>(i / kSignals);
    source.position_m = Vec3f(10.0 * Vec3(radius * std::cos(turn), y, radius * std::sin(turn)));
    source.power = same_in_all_bands(1);
    source.u = 0.5f;
  }
  return input;
}

double loudness_lufs(const AuralizerInput& input, const OutputFormat& shape) {
  AuralizerOptions options;
  options.visibility = false;
  options.output = shape;
  const auto auralizer = Auralizer::create(input, options);
  EXPECT_TRUE(auralizer.ok());
  LoudnessMeter meter(shape.channels(), shape.speakers());
  std::vector<float> block(static_cast<std::size_t>(shape.channels()) * 960);
  for (int i = 0; i < 25; ++i) {
    while ((*auralizer)->wants_keyframe()) (*auralizer)->make_keyframe(Listener{});
    (*auralizer)->mix(block);
    meter.add(block);
  }
  return meter.momentary_lufs();
}

TEST(OutputFormat, IsEquallyLoudForEveryLayoutInADiffuseField_NoAsan) {
  const AuralizerInput field = diffuse_field();
  const double omni_lufs = loudness_lufs(field, OutputFormat{});
  EXPECT_TRUE(std::isfinite(omni_lufs));
  OutputFormat headphones = *OutputFormat::from_options(true, "", false);
  headphones.head = *Hrtf::read("");
  const std::pair<const char*, OutputFormat> shapes[] = {
      {"ortf", *OutputFormat::from_options(false, "", false, "ortf")},
      {"wide", *OutputFormat::from_options(false, "", false, "wide")},
      {"5.1", *OutputFormat::from_options(false, "5.1", false)},
      {"7.1", *OutputFormat::from_options(false, "7.1", false)},
      {"7.1.4", *OutputFormat::from_options(false, "7.1.4", false)},
      {"ambisonics", *OutputFormat::from_options(false, "", true)},
      {"headphones", headphones}};
  for (const auto& [name, shape] : shapes)
    EXPECT_NEAR(loudness_lufs(field, shape), omni_lufs, 0.8) << name;
}

}  // namespace
}  // namespace clamor
