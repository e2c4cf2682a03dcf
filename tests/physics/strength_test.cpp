// Strength G of a furnished room, compared with statistical theory; and what rows of seats change
// of clarity, centre time and strength in a hall.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "bake/report/level_report.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/gltf/level_import.h"
#include "runtime/response/energy_response.h"
#include "tests/build_paths.h"
#include "tests/rooms.h"
#include "tools/analysis/room_parameters.h"

namespace clamor {
namespace {

// The violin room's box, 9 x 3.6 x 12 m by the generator. Furniture fills less than 2 % of it.
constexpr double kVolume_m3 = 9 * 3.6 * 12;

// Revised theory of G at a distance, for a given decay time. The reverberation starts with the
// direct sound, so it is weaker at larger distances:
//
//   G = 10 lg(100 / r^2 + 31200 T / V exp(-0.04 r / T)).
//
// M. Barron, L.-J. Lee. Energy relations in concert auditoriums. J. Acoust. Soc. Am. 84, 1988.
double revised_theory_db(double t60_s, double distance_m) {
  return 10 * std::log10(100 / (distance_m * distance_m) +
                         31200 * t60_s / kVolume_m3 * std::exp(-0.04 * distance_m / t60_s));
}

TEST(Strength, OfTheViolinRoomMatchesBarronsRevisedTheory) {
  const std::string level = std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb";
  auto imported = import_level(level, ImportOptions{});
  ASSERT_TRUE(imported.ok()) << imported.error().message;
  Level& room = imported->level;
  room.emitters.resize(1);
  room.emitters[0].directivity = same_in_all_bands(0);
  room.emitters[0].gain = 1;
  // The theory is that of a diffuse field. The walls of this room reflect like mirrors, which holds
  // sound between pairs of them: it then decays more slowly than its level tells.
  for (Material& material : room.materials)
    for (float& share : material.scattering) share = std::max(share, 0.5f);
  BakeOptions options;
  options.settings.sources = 6000;
  const auto baked = bake(room, options);
  ASSERT_TRUE(baked.ok()) << baked.error().message;

  std::vector<Source> sources = baked->octree.sources;
  const auto images = image_sources(baked->images, baked->emitters);
  sources.insert(sources.end(), images.begin(), images.end());
  const Emitter& violin = room.emitters[0];
  const Vec3 aside = glm::normalize(Vec3(violin.axis.z, 0, -violin.axis.x));
  const OcclusionGeometry surfaces(baked->mesh, baked->materials, sources);
  std::array<double, kBandCount> off_db{};
  constexpr int kPlaces = 4;
  for (int i = 0; i < kPlaces; ++i) {
    // Among the chairs and in front of them, on both sides, 1.3 m above the floor.
    Vec3 place =
        violin.position_m + (3.0 + 1.5 * i) * violin.axis + (i % 2 == 0 ? 1.5 : -1.5) * aside;
    place.y = 1.3;
    const RoomParameters found =
        room_parameters(energy_response(sources, baked->emitters, baked->materials,
                                        baked->settings.air, place, 0, &surfaces),
                        free_field_energy_at_10m(violin));
    for (std::size_t b = 0; b < kBandCount; ++b) {
      ASSERT_TRUE(found.g_db[b]) << i;
      off_db[b] +=
          (*found.g_db[b] - revised_theory_db(static_cast<double>(baked->statistics.decay.t30_s[b]),
                                              length(place - violin.position_m))) /
          kPlaces;
    }
  }
  // Chairs and curtains near the listeners absorb more at higher frequencies, so levels are below
  // the theory's uniform field, increasingly with frequency. A factor of two in emission,
  // reflection or reference would be 3 dB.
  for (std::size_t b = 0; b < kBandCount; ++b) {
    RecordProperty("millidecibels_in_band_" + std::to_string(b),
                   static_cast<int>(std::lround(1000 * off_db[b])));
    EXPECT_LT(off_db[b], 1) << kBandCentres_hz[b] << " Hz";
    EXPECT_GT(off_db[b], -2) << kBandCentres_hz[b] << " Hz";
  }
}

// 40 x 15 x 20 m, with stalls that rise by 1 in 30 behind a stage, and a balcony in front of the
// back wall.
Level hall_with_seats(double rows_m) {
  Material walls = testing::uniform_material(0.12f, 0.2f, kMirrorExponent);
  walls.absorption = {0.15f, 0.12f, 0.1f, 0.1f, 0.1f, 0.1f, 0.12f, 0.2f};
  Level level = testing::shoebox({40, 15, 20}, walls, {4, 1.5, 10});
  Material seats = walls;
  seats.name = "seats";
  seats.absorption = {0.2f, 0.3f, 0.45f, 0.6f, 0.7f, 0.75f, 0.75f, 0.75f};
  seats.scattering = {0.1f, 0.15f, 0.2f, 0.3f, 0.5f, 0.7f, 0.8f, 0.9f};
  seats.rows_m = static_cast<float>(rows_m);
  level.materials.push_back(seats);
  const auto across = [&](const Vec3f& a, const Vec3f& b, std::uint16_t material) {
    testing::add_quad(
        level.mesh,
        {Vec3f(a.x, a.y, 0), Vec3f(b.x, b.y, 0), Vec3f(b.x, b.y, 20), Vec3f(a.x, a.y, 20)},
        material);
  };
  across({8, 0, 0}, {8, 0.8f, 0}, 0);
  across({8, 0.8f, 0}, {40, 1.85f, 0}, 1);
  across({32, 6, 0}, {40, 8, 0}, 1);
  prepare_level(level);
  return level;
}

struct SeatedPlace {
  const char* name;
  Vec3 at_m;
};

// Parameters at each place.
std::vector<RoomParameters> heard_in(const Level& hall, std::span<const SeatedPlace> places) {
  BakeOptions options;
  options.settings.sources = 20'000;
  const auto baked = bake(hall, options);
  EXPECT_TRUE(baked.ok()) << baked.error().message;
  std::vector<Source> sources = baked->octree.sources;
  const auto images = image_sources(baked->images, baked->emitters);
  sources.insert(sources.end(), images.begin(), images.end());
  const OcclusionGeometry surfaces(baked->mesh, baked->materials, sources);
  std::vector<RoomParameters> found;
  for (const SeatedPlace& place : places)
    found.push_back(room_parameters(energy_response(sources, baked->emitters, baked->materials,
                                                    baked->settings.air, place.at_m, 0, &surfaces),
                                    free_field_energy_at_10m(hall.emitters[0])));
  return found;
}

TEST(SeatRowsInAHall, TakeEarlyLowSoundFromTheStallsAndHardlyAnyFromTheBalcony) {
  const std::array places = {
      SeatedPlace{"front stalls", {14, 1.4, 9}}, SeatedPlace{"middle stalls", {22, 1.65, 12}},
      SeatedPlace{"rear stalls", {29, 1.9, 7}}, SeatedPlace{"balcony", {36, 7.45, 11}}};
  const auto all_without = heard_in(hall_with_seats(0), places),
             all_with = heard_in(hall_with_seats(0.8), places);
  for (std::size_t p = 0; p < places.size(); ++p) {
    const RoomParameters &without = all_without[p], &with = all_with[p];
    const bool is_balcony = p + 1 == places.size();
    std::printf("| %s |", places[p].name);
    for (std::size_t b = 0; b < 5; ++b) {
      ASSERT_TRUE(with.c80_db[b] && without.c80_db[b] && with.g_db[b] && without.g_db[b]);
      const double c80_db = *with.c80_db[b] - *without.c80_db[b];
      const double g_db = *with.g_db[b] - *without.g_db[b];
      std::printf(" %+.1f, %+.0f, %+.1f |", c80_db, 1000 * (*with.ts_s[b] - *without.ts_s[b]),
                  g_db);
      if (b < 1 || b > 3) continue;  // 125 to 500 Hz
      EXPECT_LT(c80_db, is_balcony ? 0.3 : -1) << places[p].name << ", band " << b;
      EXPECT_GT(c80_db, is_balcony ? -0.5 : -5) << places[p].name << ", band " << b;
      EXPECT_NEAR(g_db, is_balcony ? 0 : -0.8, is_balcony ? 0.2 : 0.7) << places[p].name;
    }
    std::printf("\n");
  }
}

}  // namespace
}  // namespace clamor
