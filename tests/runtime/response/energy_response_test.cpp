#include "runtime/response/energy_response.h"

#include <cmath>

#include <gtest/gtest.h>

#include "formats/bake_file/page.h"

namespace clamor {
namespace {

const std::vector<Material> kMaterials(1);

Source source_of_emitter(const std::vector<Emitter>& emitters, std::uint32_t emitter) {
  Source source;
  set_from_emitter(source, emitters[emitter]);
  source.emitter = emitter;
  return source;
}

TEST(EnergyResponse, HasTheImageSourcesOfAShoebox) {
  // Direct sound and the six first-order images in 5 x 4 x 3 m with absorption 0.2 and c = 343 m/s,
  // from an independent image-source program (times in ms, levels in dB re 1 m).
  const Vec3 source(1.3, 1.7, 1.1), receiver(3.9, 2.4, 1.6), size(5, 4, 3);
  const double expected[7][2] = {{7.9843, -8.751},   {11.1170, -12.595}, {12.4172, -13.555},
                                 {13.7429, -14.437}, {14.2171, -14.731}, {14.2291, -14.739},
                                 {15.3664, -15.406}};
  std::vector<Emitter> images = {{.name = "source", .position_m = source}};
  for (int axis = 0; axis < 3; ++axis)
    for (const double wall : {0.0, size[axis]}) {
      Emitter image{.name = "image", .position_m = source, .gain = std::sqrt(0.8)};
      image.position_m[axis] = 2 * wall - source[axis];
      images.push_back(image);
    }
  std::vector<Source> sources;
  for (std::uint32_t i = 0; i < images.size(); ++i) sources.push_back(source_of_emitter(images, i));
  const Air air{.temperature_c = 293.15 * std::pow(343 / 343.2, 2) - 273.15};

  const auto arrivals = energy_response(sources, images, kMaterials, air, receiver, std::nullopt);

  ASSERT_EQ(arrivals.size(), 7u);
  for (int i = 0; i < 7; ++i) {
    EXPECT_NEAR(arrivals[i].time_s * 1e3, expected[i][0], 1e-4);
    // Air absorption is 0.001 dB on these paths at 63 Hz.
    EXPECT_NEAR(10 * std::log10(arrivals[i].energy[0]), expected[i][1], 0.002);
  }
}

TEST(EnergyResponse, StartsAllEmittersAtOnceWithAnySignals) {
  std::vector<Emitter> emitters(1);
  emitters[0].delay_s = 0.25;
  const std::vector<Source> sources = {source_of_emitter(emitters, 0)};
  const auto arrivals =
      energy_response(sources, emitters, kMaterials, Air{}, Vec3(0, 0, 3.432), std::nullopt);
  ASSERT_EQ(arrivals.size(), 1u);
  EXPECT_NEAR(arrivals[0].time_s, 0.01, 1e-12);
}

TEST(EnergyResponse, DelaysReflectionsByTheirWholePath) {
  const std::vector<Emitter> emitters(1);
  Source wall;
  wall.position_m = {0, 0, 6.864f};
  wall.normal = wall.mirror = {0, 0, -1};
  wall.delay_s = 0.02f;
  wall.power = same_in_all_bands(1);
  wall.polarity = -1;
  const std::vector<Source> sources = {wall, source_of_emitter(emitters, 0)};
  const auto arrivals =
      energy_response(sources, emitters, kMaterials, Air{}, Vec3(0, 0, 3.432), std::nullopt);
  ASSERT_EQ(arrivals.size(), 2u);
  EXPECT_NEAR(arrivals[0].time_s, 0.01, 1e-7);
  EXPECT_EQ(arrivals[0].polarity, 1);
  EXPECT_NEAR(arrivals[1].time_s, 0.03, 1e-7);
  EXPECT_EQ(arrivals[1].polarity, -1);
}

TEST(EnergyResponse, OmitsOtherEmittersAndInaudibleSources) {
  std::vector<Emitter> emitters(2);
  emitters[1].position_m = {9, 0, 0};
  Source behind;  // a wall that faces away
  behind.position_m = {0, 0, -1};
  behind.normal = behind.mirror = {0, 0, -1};
  behind.power = same_in_all_bands(1);
  const std::vector<Source> sources = {source_of_emitter(emitters, 0),
                                       source_of_emitter(emitters, 1), behind};
  const auto second = energy_response(sources, emitters, kMaterials, Air{}, Vec3(0, 0, 1), 1);
  ASSERT_EQ(second.size(), 1u);
  EXPECT_NEAR(second[0].time_s, std::sqrt(82) / 343.2, 1e-9);
  EXPECT_EQ(energy_response(sources, emitters, kMaterials, Air{}, Vec3(0, 0, 1), 0).size(), 1u);
}

}  // namespace
}  // namespace clamor
