// auralizer_parts_test.cpp: the sound of a level beside a door that the caller moves.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "common/random.h"
#include "formats/bake_file/page.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/occlusion/moving_parts.h"
#include "runtime/occlusion/part_shape.h"
#include "runtime/sampling/moving_script.h"
#include "runtime/voices/keyframe.h"
#include "tests/runtime/door_leaf.h"
#include "tests/runtime/two_rooms.h"
#include "tests/temporary_file.h"
#include "tools/analysis/click_detector.h"

namespace clamor {
namespace {

using testing::door;
using testing::door_pose;

const Listener kListener{{8, 2.1, 1.5}, 0, 0};

// Two rooms, of which the first has a source, and a door between them.
AuralizerInput rooms(const std::vector<MovablePart>& parts,
                     const std::vector<MovablePart>& built_in, Signal signal) {
  Level level = testing::two_rooms(true);
  level.signals = {std::move(signal)};
  const BakeContents contents = testing::World::baked(level, 20);
  AuralizerInput input{contents.octree.sources, contents.emitters, contents.signals,
                       contents.materials, contents.settings.air};
  input.mesh = testing::with_built_in(contents.mesh, built_in);
  input.movable_parts = parts;
  return input;
}

std::unique_ptr<Auralizer> player_of(AuralizerInput input, bool exact) {
  AuralizerOptions options;
  options.voices = static_cast<int>(input.sources.size());
  options.wait_for_pages = exact;
  auto made = Auralizer::create(std::move(input), options);
  EXPECT_TRUE(made.ok()) << made.error().message;
  return std::move(*made);
}

// The left channel; before_keyframe(time_s) moves parts.
template <class Before>
std::vector<float> left_ear_of(Auralizer& auralizer, double seconds, Before before_keyframe) {
  std::vector<float> left, block(2 * kKeyframeFrames);
  while (static_cast<double>(left.size()) < seconds * kSampleRate_hz) {
    while (auralizer.wants_keyframe()) {
      before_keyframe(auralizer.next_keyframe_time_s());
      auralizer.make_keyframe(kListener);
    }
    auralizer.mix(block);
    for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
  }
  return left;
}

void nothing(double) {}

double level_db(std::span<const float> samples) {
  double power = 0;
  for (const float sample : samples) power += static_cast<double>(sample) * sample;
  return 10 * std::log10(power / static_cast<double>(samples.size()) + 1e-12);
}

double last_level_db(const std::vector<float>& samples) {
  return level_db(std::span(samples).last(kSampleRate_hz / 5));
}

TEST(AuralizerParts, SoundAsIfTheDoorWereBuiltIn_NoAsan) {
  for (const bool exact : {true, false})
    for (const double open_deg : {0.0, 50.0, 90.0}) {
      const auto is = player_of(rooms({door(open_deg)}, {}, testing::sine()), exact);
      const auto expected = player_of(rooms({}, {door(open_deg)}, testing::sine()), exact);
      EXPECT_NEAR(last_level_db(left_ear_of(*is, 1, nothing)),
                  last_level_db(left_ear_of(*expected, 1, nothing)), 0.5)
          << open_deg << (exact ? ", exact" : "");
    }
}

// The door is at its new place from 0.5 s on; 120 ms later the voices have faded.
TEST(AuralizerParts, AreHeardWithinAKeyframe) {
  for (const bool exact : {true, false}) {
    const auto is = player_of(rooms({door(90)}, {}, testing::sine()), exact);
    const auto closed = player_of(rooms({}, {door(0)}, testing::sine()), exact);
    const PartHandle handle = is->level_parts().front();
    const auto out = left_ear_of(*is, 1, [&](double t) {
      if (t < 0.5) return;
      ASSERT_TRUE(is->parts()->move(handle, door_pose(0)).ok());
    });
    const auto expected = left_ear_of(*closed, 1, nothing);
    const std::size_t begin = static_cast<std::size_t>(0.48 * kSampleRate_hz);
    const double open_db = level_db(std::span(out).subspan(begin - 4800, 4800));
    const auto after = [&](const std::vector<float>& samples) {
      return level_db(std::span(samples).subspan(begin + 5760, 4800));
    };
    EXPECT_NEAR(after(out), after(expected), 0.5);
    EXPECT_GT(std::abs(open_db - after(out)), 1);
  }
}

// The power of all voices at each keyframe, while `before_keyframe(time_s)` moves parts.
template <class Before>
std::vector<double> power_by_keyframe(Auralizer& auralizer, const Listener& listener,
                                      double seconds, Before before_keyframe) {
  std::vector<double> powers;
  std::vector<float> block(2 * kKeyframeFrames);
  while (static_cast<double>(powers.size()) * kKeyframe_s < seconds) {
    while (auralizer.wants_keyframe()) {
      before_keyframe(auralizer.next_keyframe_time_s());
      auralizer.make_keyframe(listener);
      double& power = powers.emplace_back(0);
      for (const Voice& voice : auralizer.newest_keyframe()->voices)
        for (const Bands& gain : voice.gain)
          for (const float band : gain) power += static_cast<double>(band) * band;
    }
    auralizer.mix(block);
  }
  return powers;
}

// A player that has a door and a moving source before it.
std::unique_ptr<Auralizer> source_before(const MovablePart& door, bool exact, float transmission) {
  AuralizerOptions options;
  options.wait_for_pages = exact;
  options.keeps_keyframe = true;
  options.mixes_voices = false;
  options.moving.max_sources = 1;
  options.moving.kinds = {{"source", 0, {}}};
  AuralizerInput input = rooms({door}, {}, testing::sine());
  input.sources.clear();
  input.materials.push_back(input.materials[0]);
  input.materials[1].transmission = same_in_all_bands(transmission);
  auto made = Auralizer::create(std::move(input), options);
  EXPECT_TRUE(made.ok()) << made.error().message;
  MovingSource source;
  source.position_m = {2, 2, 1.5};
  source.start_s = -1;
  EXPECT_TRUE((*made)->moving()->add(source).ok());
  (*made)->moving()->commit();
  return std::move(*made);
}

// The voice of a sound behind a door begins to fade with the first keyframe after the commit.
TEST(AuralizerParts, ChangeTheVoicesOfTheNextKeyframe) {
  for (const bool exact : {true, false}) {
    const auto is = source_before(door(90), exact, 0);
    int keyframe = 0;
    const auto powers = power_by_keyframe(*is, kListener, 1.5, [&](double) {
      const bool closes = keyframe >= 25 && keyframe < 50;
      ++keyframe;
      ASSERT_TRUE(is->parts()->move(is->level_parts().front(), door_pose(closes ? 0 : 90)).ok());
    });
    for (std::size_t f = 0; f <= 5; ++f) {
      const double left = std::pow(std::cos(std::numbers::pi / 10 * static_cast<double>(f)), 2);
      EXPECT_NEAR(powers[24 + f] / powers[20], left, 1e-3) << f << exact;
      EXPECT_NEAR(powers[49 + f] / powers[20], 1 - left, 1e-3) << f << exact;
    }
  }
}

// The direct sound alone, through a door that transmits a fifth; reflections only make it steadier.
// The first crack is a step, because a slit of 1 cm lets long waves pass at -18 dB and one of 5 cm
// at -14 dB (tests/physics/opening_test.cpp has the exact solution).
TEST(AuralizerParts, OpenADoorInASecondInStepsOfADecibelAndTwoAtTheFirstCrack_NoAsan) {
  const auto largest_step_db = [](bool exact, double opens_s, std::size_t from_keyframe) {
    const auto is = source_before(door(0, 1), exact, 0.2f);
    const auto powers = power_by_keyframe(*is, kListener, 2, [&](double t) {
      const double open_deg = 90 * std::clamp((t - 0.5) / opens_s, 0.0, 1.0);
      ASSERT_TRUE(is->parts()->move(is->level_parts().front(), door_pose(open_deg)).ok());
    });
    double largest = 0;
    for (std::size_t k = from_keyframe; k < powers.size(); ++k)
      largest = std::max(largest, std::abs(10 * std::log10(powers[k] / powers[k - 1])));
    return largest;
  };
  for (const bool exact : {true, false}) {
    EXPECT_LT(largest_step_db(exact, 1, 20), 2) << exact;
    EXPECT_LT(largest_step_db(exact, 1, 40), 1) << exact;  // open by 25 degrees
    EXPECT_GT(largest_step_db(exact, 0.01, 20), 3) << exact;
  }
}

TEST(AuralizerParts, OpenADoorInASecondWithoutClicks_NoAsan) {
  for (const bool exact : {true, false}) {
    const auto is = player_of(rooms({door(0)}, {}, testing::sine(400)), exact);
    const PartHandle handle = is->level_parts().front();
    std::vector<float> out = left_ear_of(*is, 2, [&](double t) {
      ASSERT_TRUE(is->parts()->move(handle, door_pose(90 * std::clamp(t - 0.5, 0.0, 1.0))).ok());
    });
    float peak = 0;
    for (const float sample : out) peak = std::max(peak, std::abs(sample));
    EXPECT_GT(peak, 1e-4f);
    for (const Click& click : find_clicks(out, 1e-3 * peak))
      ADD_FAILURE() << click.sigmas << " sigmas at " << click.frame;
  }
}

// Render the samples of a level that never had the part.
TEST(AuralizerParts, ThatAreRemovedLeaveNothingBehind) {
  const auto without = player_of(rooms({}, {}, testing::sine()), true);
  const auto expected = left_ear_of(*without, 1, nothing);
  const auto is = player_of(rooms({door(0)}, {}, testing::sine()), true);
  ASSERT_TRUE(is->parts()->remove(is->level_parts().front()).ok());
  EXPECT_EQ(left_ear_of(*is, 1, nothing), expected);

  const auto later = player_of(rooms({door(0)}, {}, testing::sine()), true);
  const auto out = left_ear_of(*later, 1, [&](double t) {
    if (t < 0.3 || later->parts()->size() == 0) return;
    ASSERT_TRUE(later->parts()->remove(later->level_parts().front()).ok());
  });
  double error = 0, power = 0;
  for (std::size_t i = out.size() * 3 / 4; i < out.size(); ++i) {
    error += std::pow(static_cast<double>(out[i]) - expected[i], 2);
    power += std::pow(static_cast<double>(expected[i]), 2);
  }
  EXPECT_LT(error, 1e-6 * power);
}

// A script opens the door as a caller does.
TEST(AuralizerParts, FollowAScript) {
  const testing::TemporaryFile file(".json");
  std::ofstream(file.path()) << R"({ "parts": [ { "name": "Door", "points": [
      { "time_s": 0.2 }, { "time_s": 0.6, "roll_deg": -90 } ] } ] })";
  auto script = MovingScript::read(file.path());
  ASSERT_TRUE(script.ok()) << script.error().message;
  AuralizerInput input = rooms({door(0)}, {}, testing::sine());
  AuralizerOptions options;
  options.voices = static_cast<int>(input.sources.size());
  options.wait_for_pages = true;
  options.moving = script->options(1);
  options.script = std::make_shared<MovingScript>(std::move(*script));
  const auto scripted = std::move(*Auralizer::create(std::move(input), options));
  EXPECT_EQ(scripted->parts(), nullptr);
  const auto by_hand = player_of(rooms({door(0)}, {}, testing::sine()), true);
  const auto expected = left_ear_of(*by_hand, 1, [&](double t) {
    const double open_deg = 90 * std::clamp((t - 0.2) / 0.4, 0.0, 1.0);
    ASSERT_TRUE(by_hand->parts()->move(by_hand->level_parts()[0], door_pose(open_deg)).ok());
  });
  const auto out = left_ear_of(*scripted, 1, nothing);
  double error = 0, power = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    error += std::pow(static_cast<double>(out[i]) - expected[i], 2);
    power += std::pow(static_cast<double>(expected[i]), 2);
  }
  EXPECT_LT(error, 1e-5 * power);

  options.moving = {};
  const auto without_door = Auralizer::create(rooms({}, {}, testing::sine()), options);
  ASSERT_FALSE(without_door.ok());
  EXPECT_NE(without_door.error().message.find("'Door'"), std::string::npos);
}

TEST(AuralizerParts, MayBeAddedWhereTheOptionsTakeThem) {
  AuralizerInput input = rooms({}, {}, testing::sine());
  const std::vector<Material> materials = input.materials;
  EXPECT_EQ(player_of(rooms({}, {}, testing::sine()), false)->parts(), nullptr);
  AuralizerOptions options;
  options.takes_parts = true;
  options.voices = static_cast<int>(input.sources.size());
  const auto is = std::move(*Auralizer::create(std::move(input), options));
  ASSERT_NE(is->parts(), nullptr);
  ASSERT_TRUE(
      is->parts()->add(*PartShape::make(testing::door_leaf(), materials), door_pose(0)).ok());
  const auto closed = player_of(rooms({}, {door(0)}, testing::sine()), false);
  EXPECT_NEAR(last_level_db(left_ear_of(*is, 1, nothing)),
              last_level_db(left_ear_of(*closed, 1, nothing)), 0.5);
}

// An emitter before a plate of 2 x 2 m in the free field, which is built in or a part.
AuralizerInput plate(bool is_part) {
  AuralizerInput input;
  input.emitters.emplace_back().position_m = {2, 0.2, 0.1};
  input.signals = {testing::sine()};
  input.materials = {mirror_material()};
  Mesh sheet;
  testing::add_quad(sheet, {Vec3f(0, -1, -1), Vec3f(0, 1, -1), Vec3f(0, 1, 1), Vec3f(0, -1, 1)});
  input.sources.resize(is_part ? 1 : 2);
  for (Source& source : input.sources) set_from_emitter(source, input.emitters[0]);
  if (is_part) {
    input.movable_parts = {{"Door", sheet, {}}};
    return input;
  }
  input.mesh = sheet;
  Source& image = input.sources[1];
  image.is_image = true;
  image.u = 1;
  image.original_m = image.position_m;
  image.position_m.x = -image.position_m.x;
  image.normal.x = -image.normal.x;
  return input;
}

// The direct sound and the reflection, with edges and all.
TEST(AuralizerParts, ReflectAsIfTheyWereBuiltIn) {
  for (const bool exact : {true, false})
    for (const Vec3& place_m : {Vec3(3, 0.3, 0.4), Vec3(1, 1.8, 0), Vec3(-1, 0.1, 0.3)}) {
      AuralizerOptions options;
      options.voices = 8;
      options.wait_for_pages = exact;
      options.keeps_keyframe = true;
      options.mixes_voices = false;
      std::array<double, 2> power{};
      std::array<std::size_t, 2> voices{};
      for (const bool is_part : {false, true}) {
        const auto player = std::move(*Auralizer::create(plate(is_part), options));
        power[is_part] = power_by_keyframe(*player, {place_m, 0, 0}, 0.5, nothing).back();
        voices[is_part] = player->newest_keyframe()->voices.size();
      }
      EXPECT_EQ(voices[0], voices[1]) << place_m.x;
      EXPECT_NEAR(10 * std::log10(power[1] / power[0]), 0, 0.05) << place_m.x << exact;
    }
}

TEST(AuralizerParts, ThatAreNoPartsAreRefused) {
  MovablePart part = door(0);
  part.rest_pose.position_m.x = NAN;
  const auto made = Auralizer::create(rooms({part}, {}, testing::sine()), {});
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("'Door'"), std::string::npos) << made.error().message;
}

}  // namespace
}  // namespace clamor
