// Image sources as a listener hears them, from a bake to the output.
#include <cmath>
#include <complex>
#include <memory>
#include <numbers>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/air.h"
#include "common/sample_rate.h"
#include "formats/bake_file/bake_file.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/mixing/keyframe_maker.h"
#include "runtime/sampling/moving_sources.h"
#include "runtime/voices/keyframe.h"
#include "tests/rooms.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

constexpr double kFrequency_hz = 500, kDistance_m = 6, kHeight_m = 1.5;

// The complex amplitude of a sine that an emitter plays, at a height above a floor or without one.
std::complex<double> heard(bool has_floor, double height_m, int voices) {
  Level level = testing::shoebox({1, 1, 1}, testing::uniform_material(0, 0, kMirrorExponent),
                                 {0, kHeight_m, 0});
  level.signals = {testing::sine(kFrequency_hz)};
  level.mesh = {};
  if (has_floor)
    testing::add_quad(level.mesh,
                      {Vec3f(-9, 0, -9), Vec3f(9, 0, -9), Vec3f(9, 0, 9), Vec3f(-9, 0, 9)});
  BakeOptions baking;
  baking.settings = {.photons = 1000, .sources = 1000, .early_order = 1};
  const auto contents = bake(level, baking);
  EXPECT_TRUE(contents.ok());
  AuralizerOptions options;
  options.voices = voices;
  options.wait_for_pages = true;
  auto auralizer = Auralizer::create(testing::as_file(*contents), options);
  EXPECT_TRUE(auralizer.ok()) << auralizer.error().message;
  const Listener listener{{kDistance_m, height_m, 0}, 0, 0};
  std::vector<float> block(2 * kKeyframeFrames);
  std::complex<double> sum = 0;
  constexpr int kSkipped = 24'000, kWhole = 24'000;
  for (int frame = 0; frame < kSkipped + kWhole;) {
    while ((*auralizer)->wants_keyframe()) (*auralizer)->make_keyframe(listener);
    (*auralizer)->mix(block);
    for (std::size_t f = 0; f < block.size(); f += 2, ++frame)
      if (frame >= kSkipped && frame < kSkipped + kWhole)
        sum += static_cast<double>(block[f]) *
               std::polar(1.0, -2 * std::numbers::pi * kFrequency_hz * frame / kSampleRate_hz);
  }
  return sum;
}

// Where the two paths differ by half a wavelength, a floor cancels the direct sound to what its
// image has lost by the longer path; where they differ by a whole one, it doubles it.
TEST(AuralizerImages, InterfereWithTheDirectSoundWhateverTheNumberOfVoices) {
  const double speed_mps = speed_of_sound_mps(Level().air);
  for (const double height_m : {0.7, 1.4}) {
    const double distance_m = kDistance_m - kEarDistance_m / 2;  // of the left ear
    const double direct_m = std::hypot(distance_m, kHeight_m - height_m);
    const double image_m = std::hypot(distance_m, kHeight_m + height_m);
    const std::complex<double> expected =
        1.0 + direct_m / image_m *
                  std::polar(1.0, -2 * std::numbers::pi * kFrequency_hz * (image_m - direct_m) /
                                      speed_mps);
    const std::complex<double> alone = heard(false, height_m, 2000);
    for (const int voices : {2000, 8}) {
      const std::complex<double> ratio = heard(true, height_m, voices) / alone;
      EXPECT_NEAR(std::abs(ratio - expected), 0, 0.03) << height_m << " m: " << ratio << expected;
    }
  }
}

// A level without emitters, with a floor of this size and a probe above it.
std::shared_ptr<const BakeFile> floor_with_probe(float half_m) {
  Level level = testing::shoebox({1, 1, 1}, testing::uniform_material(0, 0, kMirrorExponent), {});
  level.emitters.clear();
  level.signals = {testing::sine(kFrequency_hz)};
  level.mesh = {};
  testing::add_quad(level.mesh, {Vec3f(-half_m, 0, -half_m), Vec3f(half_m, 0, -half_m),
                                 Vec3f(half_m, 0, half_m), Vec3f(-half_m, 0, half_m)});
  BakeOptions baking{.settings = {.photons = 1000, .sources = 1000}};
  baking.probes_m = {{0, kHeight_m, 0}};
  const auto contents = bake(level, baking);
  EXPECT_TRUE(contents.ok()) << contents.error().message;
  return testing::as_file(*contents);
}

// The left ear of someone past whom sources drive at 25 m/s, each at a height of its own.
std::vector<float> passing(const std::shared_ptr<const BakeFile>& file, int voices,
                           std::span<const double> heights_m, float reverberation) {
  constexpr double kSpeed_mps = 25;
  AuralizerOptions options;
  options.voices = voices;
  options.wait_for_pages = true;
  options.moving.max_sources = heights_m.size();
  options.moving.kinds = {{"car", 0, {}}};
  auto auralizer = Auralizer::create(file, options);
  EXPECT_TRUE(auralizer.ok()) << auralizer.error().message;
  MovingSource car;
  car.start_s = -10;
  car.reverberation = reverberation;
  std::vector<MovingHandle> cars;
  for (std::size_t i = 0; i < heights_m.size(); ++i)
    cars.push_back(*(*auralizer)->moving()->add(car));
  std::vector<float> left, block(2 * kKeyframeFrames);
  while (left.size() < kSampleRate_hz) {
    while ((*auralizer)->wants_keyframe()) {
      const double time_s = (*auralizer)->next_keyframe_time_s();
      for (std::size_t i = 0; i < cars.size(); ++i)
        EXPECT_TRUE(
            (*auralizer)
                ->moving()
                ->move(cars[i], {kSpeed_mps * (time_s - 0.5), heights_m[i], -2}, {kSpeed_mps, 0, 0})
                .ok());
      (*auralizer)->moving()->commit(time_s);
      (*auralizer)->make_keyframe({{0, 1.7, 3}, 0, 0});
    }
    (*auralizer)->mix(block);
    for (std::size_t f = 0; f < block.size(); f += 2) left.push_back(block[f]);
  }
  return left;
}

// The image of a moving source in a floor is heard as another source would be that drives below it,
// in level, delay and Doppler shift.
TEST(AuralizerImages, OfAMovingSourceMoveAsItsMirrorImage) {
  const auto file = floor_with_probe(40);
  const double height_m[] = {kHeight_m}, heights_m[] = {kHeight_m, -kHeight_m};
  const auto free_field = [&](std::span<const double> of_m) {
    return passing(floor_with_probe(0.01f), 100, of_m, 0);
  };
  const std::vector<float> expected = free_field(heights_m), direct = free_field(height_m);
  for (const int voices : {100, 2}) {
    const std::vector<float> left = passing(file, voices, height_m, 1);
    double error = 0, without_image = 0, power = 0;
    for (std::size_t f = kSampleRate_hz / 10; f < left.size(); ++f) {  // the start fades in
      error += std::pow(static_cast<double>(left[f] - expected[f]), 2);
      without_image += std::pow(static_cast<double>(direct[f] - expected[f]), 2);
      power += std::pow(static_cast<double>(expected[f]), 2);
    }
    EXPECT_LT(error, 0.001 * power) << voices;
    EXPECT_GT(without_image, 0.3 * power);
  }
}

}  // namespace
}  // namespace clamor
