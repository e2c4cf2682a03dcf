// driving_source_test.cpp: the level of a source that walks, drives or flies from one room through
// a doorway into another, keyframe by keyframe.
//
// The level is the power of all voices' gains: that of the sound without interference and the
// signal's own fluctuation, which would hide steps of a decibel in 20 ms.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/sample_rate.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/voices/keyframe.h"
#include "tests/rooms.h"
#include "tests/temporary_file.h"
#include "tools/analysis/click_detector.h"

namespace clamor {
namespace {

constexpr double kWall_m = 10, kEnd_m = 20;  // along x

Signal low_tones() {
  Signal tones{"tones", {}, true};
  for (int i = 0; i < kSampleRate_hz; ++i) {
    double sum = 0;
    for (const double frequency_hz : {125, 250, 500, 1000})
      sum += 0.15 * std::sin(2 * std::numbers::pi * frequency_hz * i / kSampleRate_hz);
    tones.samples.push_back(static_cast<float>(sum));
  }
  return tones;
}

// Two rooms of 10 by 5 m with a doorway between them, and probes on the way through it.
std::shared_ptr<const BakeFile> rooms_with_doorway() {
  static const std::shared_ptr<const BakeFile> file = [] {
    Level level = testing::shoebox({kEnd_m, 3, 5}, testing::uniform_material(0.15f, 0.5f, 8), {});
    const float x = kWall_m;
    testing::add_quad(level.mesh, {Vec3f(x, 0, 0), Vec3f(x, 3, 0), Vec3f(x, 3, 2), Vec3f(x, 0, 2)});
    testing::add_quad(level.mesh, {Vec3f(x, 0, 3), Vec3f(x, 3, 3), Vec3f(x, 3, 5), Vec3f(x, 0, 5)});
    testing::add_quad(level.mesh,
                      {Vec3f(x, 2.1f, 2), Vec3f(x, 3, 2), Vec3f(x, 3, 3), Vec3f(x, 2.1f, 3)});
    level.emitters.clear();
    level.signals = {low_tones()};
    BakeOptions options{.settings = {.photons = 1000}, .threads = 2};
    for (const double probe_x_m : {1.25, 3.75, 6.25, 8.75, 11.25, 13.75, 16.25, 18.75})
      options.probes_m.push_back({probe_x_m, 1.5, 2.4});
    options.probe_sources = 1000;
    auto contents = bake(level, options);
    EXPECT_TRUE(contents.ok()) << contents.error().message;
    return testing::as_file(*contents);
  }();
  return file;
}

struct Drive {
  double speed_mps = 0, from_m = 0, to_m = 0;
  float reverberation = 1;
  bool mixes = false;
};
struct Heard {
  std::vector<double> level_db;  // by keyframe
  std::vector<float> left;
};

// The source stands for half a second, drives to its goal, and stands for a moment again.
Heard heard_of(const Drive& drive, const Vec3& ear_m) {
  AuralizerOptions options;
  options.voices = 1000;
  options.wait_for_pages = true;
  options.keeps_keyframe = true;
  options.mixes_voices = drive.mixes;
  options.moving.max_sources = 1;
  options.moving.kinds = {{"car", 0, {}}};
  auto made = Auralizer::create(rooms_with_doorway(), options);
  EXPECT_TRUE(made.ok()) << made.error().message;
  Auralizer& auralizer = **made;
  MovingSource car;
  car.start_s = -10;
  car.reverberation = drive.reverberation;
  const auto handle = auralizer.moving()->add(car);
  EXPECT_TRUE(handle.ok());
  const double goes_s = drive.speed_mps > 0 ? (drive.to_m - drive.from_m) / drive.speed_mps : 0.0;
  Heard heard;
  std::vector<float> block(2 * kKeyframeFrames);
  for (double time_s = 0; time_s < 0.5 + goes_s + 0.5;) {
    while (auralizer.wants_keyframe()) {
      time_s = auralizer.next_keyframe_time_s();
      const double drives_s = std::clamp(time_s - 0.5, 0.0, goes_s);
      const bool drives = drives_s > 0 && drives_s < goes_s;
      EXPECT_TRUE(auralizer.moving()
                      ->move(*handle, {drive.from_m + drive.speed_mps * drives_s, 1.5, 2.5},
                             {drives ? drive.speed_mps : 0, 0, 0})
                      .ok());
      auralizer.moving()->commit(time_s);
      auralizer.make_keyframe({ear_m, 0, 0});
      double power = 0;
      for (const Voice& voice : auralizer.newest_keyframe()->voices)
        for (const Bands& gain : voice.gain)
          for (std::size_t b = 1; b <= 4; ++b)  // of the tones
            power += static_cast<double>(gain[b]) * gain[b];
      if (time_s > 0.4) heard.level_db.push_back(10 * std::log10(power + 1e-9));
    }
    auralizer.mix(block);
    for (std::size_t f = 0; f < block.size(); f += 2) heard.left.push_back(block[f]);
  }
  return heard;
}

double largest_step_db(const std::vector<double>& level_db) {
  double largest = 0;
  for (std::size_t k = 1; k < level_db.size(); ++k)
    largest = std::max(largest, std::abs(level_db[k] - level_db[k - 1]));
  return largest;
}

constexpr Vec3 kEars_m[] = {{15, 1.6, 1}, {5, 1.6, 4.2}};

TEST(DrivingSource, HasASteadyLevelWhereItStands_NoAsan) {
  for (const double x_m : {3.0, 9.9, 15.0})
    EXPECT_LT(largest_step_db(heard_of({.from_m = x_m}, kEars_m[0]).level_db), 0.02) << x_m;
}

// Weights and powers that follow the place at once step by up to 4.5 dB more than the direct sound.
TEST(DrivingSource, StepsByNoMoreThanADecibelBeyondItsDirectSound_NoAsan) {
  for (const Vec3& ear_m : kEars_m)
    for (Drive drive : {Drive{1.5, 8.5, 11.5}, Drive{30, 1, 19}}) {
      const auto whole_db = heard_of(drive, ear_m).level_db;
      drive.reverberation = 0;
      const auto direct_db = heard_of(drive, ear_m).level_db;
      ASSERT_EQ(whole_db.size(), direct_db.size());
      double beyond_db = 0;
      for (std::size_t k = 1; k < whole_db.size(); ++k)
        beyond_db = std::max(beyond_db, std::abs(whole_db[k] - whole_db[k - 1]) -
                                            std::abs(direct_db[k] - direct_db[k - 1]));
      EXPECT_LT(beyond_db, 1) << drive.speed_mps << " m/s, heard at " << ear_m.x;
      EXPECT_GT(largest_step_db(whole_db), 0.1);  // it goes into another room
    }
}

TEST(DrivingSource, DoesNotClick_NoAsan) {
  for (const Drive& drive : {Drive{15, 4, 16, 1, true}, Drive{30, 4, 16, 1, true}}) {
    const auto left = heard_of(drive, kEars_m[0]).left;
    float peak = 0;
    for (const float sample : left) peak = std::max(peak, std::abs(sample));
    EXPECT_GT(peak, 0.01f);
    for (const Click& click : find_clicks(left, 1e-3 * static_cast<double>(peak)))
      ADD_FAILURE() << click.sigmas << " sigmas at " << click.frame;
  }
}

}  // namespace
}  // namespace clamor
