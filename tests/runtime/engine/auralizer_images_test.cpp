// Image sources as a listener hears them, from a bake to the output.
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/air.h"
#include "common/sample_rate.h"
#include "runtime/engine/auralizer.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/mixing/keyframe_maker.h"
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

}  // namespace
}  // namespace clamor
