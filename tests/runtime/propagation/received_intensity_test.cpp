#include "runtime/propagation/received_intensity.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "formats/bake_file/page.h"

namespace clamor {
namespace {

const Bands kNoLoss{};

Source emitter_source(const Emitter& emitter) {
  Source source;
  set_from_emitter(source, emitter);
  return source;
}

// A patch of the floor that radiates power 2 upwards, and at 45 degrees towards +X where it is
// specular.
Source floor_source(std::uint16_t material) {
  Source source;
  source.normal = {0, 1, 0};
  source.mirror = {std::sqrt(0.5f), std::sqrt(0.5f), 0};
  source.power = same_in_all_bands(2);
  source.patch_radius_m = 0.5f;
  source.material = material;
  return source;
}

ReflectionLaws lambert_and_lobe() {
  std::vector<Material> materials(2);
  materials[1].scattering = same_in_all_bands(0);
  materials[1].phong = same_in_all_bands(30);
  return ReflectionLaws(materials);
}

double intensity_db(double intensity) { return 10 * std::log10(intensity); }

TEST(ReceivedIntensity, OfAnEmitterFallsSixDecibelsPerDoublingOfDistance) {
  const std::vector<Emitter> emitters = {{.name = "a", .position_m = {1, 2, 3}}};
  for (const double r_m : {1.0, 2.0, 4.0, 8.0}) {
    const Bands heard = received_intensity(emitter_source(emitters[0]), emitters,
                                           lambert_and_lobe(), kNoLoss, Vec3(1, 2 + r_m, 3));
    for (const float intensity : heard)
      EXPECT_NEAR(intensity_db(intensity), -20 * std::log10(r_m), 1e-5);
  }
}

TEST(ReceivedIntensity, OfAnEmitterFollowsItsGainAndDirectivity) {
  Emitter emitter{.name = "a", .axis = {1, 0, 0}, .gain = 0.5};
  emitter.directivity = {0, 1, 2, 3, 4, 5, 6, 7};
  const Vec3 at = Vec3(0.5, std::sqrt(0.75), 0) * 2.0;  // 60 degrees off the axis
  const Bands heard =
      received_intensity(emitter_source(emitter), {emitter}, lambert_and_lobe(), kNoLoss, at);
  for (std::size_t b = 0; b < kBandCount; ++b)
    EXPECT_NEAR(heard[b], 0.25 / 4 * std::pow(0.75, b), 1e-7);
}

TEST(ReceivedIntensity, IsFiniteInsideAnEmitterAndOnASurface) {
  const std::vector<Emitter> emitters(1);
  EXPECT_FLOAT_EQ(received_intensity(emitter_source(emitters[0]), emitters, lambert_and_lobe(),
                                     kNoLoss, Vec3(0))[0],
                  1 / (kEmitterRadius_m * kEmitterRadius_m));
  // The listener is on the patch itself, which has a radius of 0.5 m.
  EXPECT_NEAR(
      received_intensity(floor_source(0), emitters, lambert_and_lobe(), kNoLoss, Vec3(0))[0],
      2 / std::numbers::pi / 0.25, 1e-5);
}

TEST(ReceivedIntensity, IsReducedByAirAbsorption) {
  Bands loss{};
  loss[7] = 0.02f;
  const std::vector<Emitter> emitters(1);
  const Bands heard = received_intensity(emitter_source(emitters[0]), emitters, lambert_and_lobe(),
                                         loss, Vec3(0, 0, 50));
  EXPECT_NEAR(heard[0], 1.0 / 2500, 1e-9);
  EXPECT_NEAR(heard[7] / heard[0], std::exp(-1.0), 1e-6);
}

TEST(ReceivedIntensity, OfARoughWallIsLambertian) {
  const std::vector<Emitter> emitters(1);
  for (const double angle : {0.0, 0.5, 1.2}) {
    const Vec3 at = 3.0 * Vec3(std::sin(angle), std::cos(angle), 0);
    const Bands heard =
        received_intensity(floor_source(0), emitters, lambert_and_lobe(), kNoLoss, at);
    EXPECT_NEAR(heard[3], 2 * std::cos(angle) / std::numbers::pi / 9, 1e-6);
  }
}

TEST(ReceivedIntensity, OfASmoothWallIsStrongestInTheMirrorDirection) {
  const std::vector<Emitter> emitters(1);
  const auto heard_at = [&](double angle) {
    const Vec3 at = 3.0 * Vec3(std::sin(angle), std::cos(angle), 0);
    return received_intensity(floor_source(1), emitters, lambert_and_lobe(), kNoLoss, at)[0];
  };
  const double mirror = std::numbers::pi / 4;
  // The density of the lobe there is (p + 1) / 2 pi; its compensation adds 1.7 % of the diffuse 1 /
  // pi.
  EXPECT_NEAR(heard_at(mirror), 2 * 31 / (2 * std::numbers::pi) / 9, 0.02);
  EXPECT_GT(heard_at(mirror), 2 * heard_at(mirror + 0.3));
  EXPECT_GT(heard_at(mirror), 2 * heard_at(mirror - 0.3));
}

TEST(ReceivedIntensity, IsZeroBehindAWall) {
  const std::vector<Emitter> emitters(1);
  for (const std::uint16_t material : {0, 1})
    EXPECT_EQ(received_intensity(floor_source(material), emitters, lambert_and_lobe(), kNoLoss,
                                 Vec3(1, -0.01, 0)),
              Bands{});
}

}  // namespace
}  // namespace clamor
