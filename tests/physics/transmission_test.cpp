// Sound that passes doors and walls of the presets, compared with statistical theory.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/air.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/level/material_presets.h"
#include "runtime/response/energy_response.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

const Vec3 kSize_m(10, 3, 4);  // of both rooms together
constexpr double kWall_x_m = 5, kDoor_m2 = 0.9 * 2;

// Two rooms of 5 x 3 x 4 m with plastered walls, which scatter so that the field is diffuse, and a
// closed door between them. The emitter is in the first room.
Level rooms_with_a_closed_door() {
  Level level = testing::shoebox(kSize_m, *MaterialPresets::built_in().get("plaster"), {1, 1.5, 1});
  level.materials.push_back(*MaterialPresets::built_in().get("door"));
  for (Material& material : level.materials) material.scattering = same_in_all_bands(0.5f);
  const auto wall = [&](double high_y, double low_y, double low_z, double high_z, int material) {
    const auto x = static_cast<float>(kWall_x_m);
    testing::add_quad(level.mesh,
                      {Vec3f(x, low_y, low_z), Vec3f(x, high_y, low_z), Vec3f(x, high_y, high_z),
                       Vec3f(x, low_y, high_z)},
                      static_cast<std::uint16_t>(material));
  };
  wall(3, 0, 0, 1.5, 0);
  wall(3, 0, 2.4, 4, 0);
  wall(3, 2, 1.5, 2.4, 0);
  wall(2, 0, 1.5, 2.4, 1);
  return level;
}

// Energy at some places, far from walls and from the emitter.
Bands energy_in(const BakeContents& contents, double room_x_m) {
  const OcclusionGeometry surfaces(contents.mesh, contents.materials);
  std::vector<Source> sources = contents.octree.sources;
  const auto images = image_sources(contents.images, contents.emitters);
  sources.insert(sources.end(), images.begin(), images.end());
  Bands sum{};
  for (const Vec3& place_m : {Vec3(3, 1.2, 3), Vec3(3.6, 1.7, 2.9), Vec3(2.5, 1.4, 3.2)})
    for (const Arrival& arrival :
         energy_response(sources, contents.emitters, contents.materials, contents.settings.air,
                         place_m + Vec3(room_x_m, 0, 0), {}, &surfaces))
      for (std::size_t b = 0; b < kBandCount; ++b) sum[b] += arrival.energy[b];
  return sum;
}

// The level difference between two rooms is D = R + 10 lg(A / S), with A the absorption area of the
// second room and S and R those of what separates them: H. Kuttruff, Room Acoustics, ch. 10, as ISO
// 16283-1 defines R. A contains what the air absorbs, 4 m V, and what passes back.
TEST(Transmission, OfTheDefaultDoorLeavesTheNextRoomAsLoudAsTheorySays) {
  const Level level = rooms_with_a_closed_door();
  BakeOptions options;
  options.settings.photons = 40'000;
  options.settings.sources = 20'000;
  options.threads = 2;
  const auto baked = bake(level, options);
  ASSERT_TRUE(baked.ok()) << baked.error().message;
  const Bands near = energy_in(*baked, 0), far = energy_in(*baked, kWall_x_m);
  const Bands loss_per_m = air_loss_per_m(level.air);
  const Material &plaster = level.materials[0], &door = level.materials[1];
  const double surface_m2 = 2 * (5 * 3 + 5 * 4 + 3 * 4), volume_m3 = 5 * 3 * 4;
  for (std::size_t b = 1; b < kBandCount; ++b) {
    const auto at = [b](const Bands& bands) { return static_cast<double>(bands[b]); };
    const double area_m2 = at(plaster.absorption) * (surface_m2 - kDoor_m2) +
                           at(door.absorption) * kDoor_m2 + 4 * at(loss_per_m) * volume_m3;
    const double passing_m2 =
        at(door.transmission) * kDoor_m2 + at(plaster.transmission) * (3 * 4 - kDoor_m2);
    const double expected_db = 10 * std::log10(area_m2 / passing_m2);
    const double measured_db = 10 * std::log10(at(near) / at(far));
    // The direct sound and the places add up to a decibel, a tenth of the far paths another.
    EXPECT_NEAR(measured_db, expected_db, 2) << kBandCentres_hz[b] << " Hz";
    if (kBandCentres_hz[b] >= 250 && kBandCentres_hz[b] <= 4000) {
      EXPECT_GT(measured_db, 19) << kBandCentres_hz[b] << " Hz";
      EXPECT_LT(measured_db, 35) << kBandCentres_hz[b] << " Hz";
    }
  }
}

}  // namespace
}  // namespace clamor
