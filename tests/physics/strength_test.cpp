// Strength G of a furnished room, compared with statistical theory.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/gltf/level_import.h"
#include "runtime/response/energy_response.h"
#include "tests/build_paths.h"
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
  const OcclusionGeometry surfaces(baked->mesh, baked->materials);
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

}  // namespace
}  // namespace clamor
