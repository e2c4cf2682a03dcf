// auralizer_moving_sources_test.cpp: pitch, onsets, clicks and occlusion of moving sources.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "runtime/engine/auralizer_input.h"
#include "runtime/engine/auralizer_options.h"
#include "tests/baked_room.h"
#include "tests/runtime/hrtf_mixing.h"
#include "tests/runtime/moving_field.h"
#include "tests/temporary_file.h"
#include "tools/analysis/click_detector.h"
#include "tools/strategies/strategies.h"

namespace clamor {
namespace {

using testing::empty_field;
using testing::heard;
using testing::place_in_room;

TEST(MovingSources, AppearMoveChangeAndDisappearWithoutClicks) {
  const auto auralizer = empty_field({testing::sine(200), testing::sine(300)}, 50, "priority", 8);
  MovingSources& moving = *auralizer->moving();
  std::vector<MovingHandle> handles;
  const auto source = [](std::uint32_t i, double t) {
    MovingSource at;
    at.kind = (i + static_cast<std::uint32_t>(t)) % 2;
    at.position_m = {4 * std::sin(t + i), 3 * std::cos(1.3 * t + 2 * i), 2.0 + 0.1 * i};
    at.gain = same_in_all_bands(0.05f + 0.05f * static_cast<float>(std::fmod(t, 1)));
    return at;
  };
  int keyframe = 0;
  std::vector<float> out = heard(*auralizer, 6, [&](double t) {
    if (keyframe % 10 == 0 && t < 4) handles.push_back(*moving.add(source(keyframe, t)));
    if (keyframe % 20 == 19 && !handles.empty()) {
      ASSERT_TRUE(moving.remove(handles.front()).ok());
      handles.erase(handles.begin());
    }
    for (std::uint32_t i = 0; i < handles.size(); ++i)
      ASSERT_TRUE(moving.change(handles[i], source(i, t)).ok());
    if (t >= 5) {
      for (const MovingHandle handle : handles) ASSERT_TRUE(moving.remove(handle).ok());
      handles.clear();
    }
    moving.commit();
    ++keyframe;
  });
  float peak = 0;
  for (const float sample : out) peak = std::max(peak, std::abs(sample));
  EXPECT_GT(peak, 0.05f);
  // The last second is silent; digital silence is outside the click detector's model.
  const std::size_t end = std::size_t{5} * kSampleRate_hz;
  EXPECT_LT(std::abs(out.back()), 1e-6f);
  for (const Click& click : find_clicks(std::span(out).first(end), 1e-3 * peak))
    ADD_FAILURE() << click.sigmas << " sigmas at " << click.frame;
}

TEST(MovingSources, SoundLikeStrategyAllWithEnoughVoices) {
  const auto few = empty_field({testing::sine(200), testing::sine(300)}, 20);
  const auto all = empty_field({testing::sine(200), testing::sine(300)}, 20, "all");
  const auto play = [](Auralizer& auralizer) {
    MovingSources& moving = *auralizer.moving();
    for (std::uint32_t i = 0; i < 20; ++i) {
      MovingSource source;
      source.kind = i % 2;
      source.position_m = place_in_room(i, 0);
      source.velocity_mps = {1, 0, 2};
      EXPECT_TRUE(moving.add(source).ok());
    }
    moving.commit(0);
    return heard(auralizer, 1, [](double) {});
  };
  EXPECT_EQ(play(*few), play(*all));
}

// A listener at x = 3, a wall of 40 x 40 m across x = `wall_x_m`, and a moving tone of 1 kHz.
// `wait` renders exactly, as an offline render does.
class BesideAWall {
 public:
  BesideAWall(float wall_x_m, float lets_through, bool wait) {
    AuralizerInput input;
    input.materials.resize(1);
    input.materials[0].absorption = same_in_all_bands(0.9f);
    input.materials[0].transmission = same_in_all_bands(lets_through);
    for (const auto& [y, z] : {std::pair(-20, -20), {20, -20}, {20, 20}, {-20, 20}})
      input.mesh.vertices_m.push_back({wall_x_m, y, z});
    input.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    input.mesh.materials = {0, 0};
    AuralizerOptions options;
    options.moving.max_sources = 1;
    options.moving.signals = {testing::sine(1000)};
    options.moving.kinds = {{"tone", 0, {}}};
    options.wait_for_pages = wait;
    auralizer_ = std::move(*Auralizer::create(std::move(input), options));
    source_ = *auralizer_->moving()->add({.position_m = {2, 0, 0}});
  }

  // Level 0.8 s after the source moved there.
  double level_db(const Vec3& position_m) {
    EXPECT_TRUE(auralizer_->moving()->move(source_, position_m).ok());
    auralizer_->moving()->commit();
    std::vector<float> block(2 * kKeyframeFrames);
    double power = 0;
    for (int keyframe = 0; keyframe < 40; ++keyframe) {
      while (auralizer_->wants_keyframe()) auralizer_->make_keyframe({{3, 0, 0}, 0, 0});
      auralizer_->mix(block);
      power = 0;
      for (const float sample : block) power += static_cast<double>(sample) * sample;
    }
    return 10 * std::log10(power + 1e-30);
  }

 private:
  std::unique_ptr<Auralizer> auralizer_;
  MovingHandle source_;
};

TEST(MovingSources, AreOccludedByAnOpaqueWall) {
  for (const bool wait : {true, false}) {
    BesideAWall world(0, 0, wait);
    const double before_db = world.level_db({2, 0, 1});
    // From 1 m to 5 m away, and around the wall by a detour of 34 m.
    EXPECT_LT(world.level_db({-2, 0, 1}), before_db - 45);
    EXPECT_NEAR(world.level_db({2, 0, 1}), before_db, 0.1);
  }
}

TEST(MovingSources, AreAttenuatedByTheTransmissionOfAWall) {
  for (const bool wait : {true, false}) {
    BesideAWall world(0, 0.01f, wait);
    const double before_db = world.level_db({2, 0, 0});
    // The source is 1 m away at first and then 5 m; diffraction around the wall has a detour of 34
    // m.
    EXPECT_NEAR(world.level_db({-2, 0, 0}) - before_db, 20 * std::log10(1 / 5.0) - 20, 0.2);
    EXPECT_NEAR(world.level_db({2, 0, 0}), before_db, 0.1);
  }
}

TEST(MovingSources, AreOccludedByAWallThatTheyCrossInOneStep) {
  for (const bool wait : {true, false}) {
    BesideAWall world(0.3f, 0, wait);
    // A visibility cached for an occluded source is valid within half a metre here, and the wall
    // lies in between.
    const double before_db = world.level_db({0.45, 0, 0});
    EXPECT_LT(world.level_db({0.1, 0, 0}), before_db - 35);
    EXPECT_NEAR(world.level_db({0.45, 0, 0}), before_db, 0.1);
  }
}

TEST(MovingSources, NeedAStrategyThatSupportsThem) {
  AuralizerOptions options;
  options.moving.max_sources = 1;
  options.strategy = make_strategy("importance");
  const auto made = Auralizer::create(testing::baked_room(), options);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("knows nothing of moving sources"), std::string::npos);
}

}  // namespace
}  // namespace clamor
