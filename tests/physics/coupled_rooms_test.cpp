// Levels in a room that sound reaches through a doorway only, against a tracer of its own, and
// through a closed door, compared with statistical theory.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/air.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/level/material_presets.h"
#include "runtime/occlusion/occlusion_batch.h"
#include "runtime/propagation/received_intensity.h"
#include "runtime/response/energy_response.h"
#include "tests/portal_rooms.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

// 500 Hz to 4 kHz. Below, the doorway diffracts, which the tracer knows nothing about.
constexpr std::size_t kFirstTraced = 3, kTracedBands = 4;
using TracedBands = std::array<double, kTracedBands>;

// Two boxes along x with walls of one material, and a doorway in the wall between them. Sound
// travels in straight lines and is reflected by a mirror or by Lambert's law.
class DoorwayTracer {
 public:
  struct Rooms {
    Vec3 size_m{};  // of both together
    double wall_x_m = 0;
    double door_height_m = 0, door_low_z_m = 0, door_high_z_m = 0;
    TracedBands absorption{}, air_loss_per_m{};
    double scattering = 0;
  };

  DoorwayTracer(const Rooms& rooms, std::uint64_t seed) : rooms_(rooms), random_(seed) {}

  // Energy per area that passes balls at these places, relative to what passes at 1 m from the
  // source: powers times lengths of paths in the balls over their volumes, times 4 pi m2.
  std::vector<TracedBands> trace(const Vec3& source_m, const std::vector<Vec3>& places_m,
                                 double radius_m, int rays) {
    std::vector<TracedBands> heard(places_m.size());
    const double scale =
        4 * std::numbers::pi / (4.0 / 3 * std::numbers::pi * std::pow(radius_m, 3)) / rays;
    for (int ray = 0; ray < rays; ++ray) {
      Vec3 at_m = source_m, way = on_sphere();
      TracedBands power;
      power.fill(scale);
      while (power[0] > 1e-5 * scale) {
        const auto [length_m, axis] = to_wall(at_m, way);
        for (std::size_t p = 0; p < places_m.size(); ++p)
          add_chord(places_m[p] - at_m, way, length_m, radius_m, power, heard[p]);
        at_m += way * length_m;
        for (std::size_t b = 0; b < kTracedBands; ++b)
          power[b] *= std::exp(-rooms_.air_loss_per_m[b] * length_m);
        if (axis == 0 && std::abs(at_m.x - rooms_.wall_x_m) < 1e-9 &&
            at_m.y < rooms_.door_height_m && at_m.z > rooms_.door_low_z_m &&
            at_m.z < rooms_.door_high_z_m)
          continue;
        for (std::size_t b = 0; b < kTracedBands; ++b) power[b] *= 1 - rooms_.absorption[b];
        const double inwards = way[axis] > 0 ? -1 : 1;
        if (uniform() < rooms_.scattering)
          way = scattered(axis, inwards);
        else
          way[axis] = -way[axis];
      }
    }
    return heard;
  }

 private:
  struct Wall {
    double length_m;
    int axis;
  };
  // The first wall that the ray meets, that with the doorway included.
  Wall to_wall(const Vec3& at_m, const Vec3& way) const {
    Wall nearest{std::numeric_limits<double>::max(), 0};
    const auto meet = [&](int axis, double plane_m) {
      const double length_m = (plane_m - at_m[axis]) / way[axis];
      if (way[axis] != 0 && length_m > 1e-9 && length_m < nearest.length_m)
        nearest = {length_m, axis};
    };
    for (int axis = 0; axis < 3; ++axis) {
      meet(axis, 0);
      meet(axis, rooms_.size_m[axis]);
    }
    meet(0, rooms_.wall_x_m);
    return nearest;
  }

  static void add_chord(const Vec3& to_middle_m, const Vec3& way, double length_m, double radius_m,
                        const TracedBands& power, TracedBands& heard) {
    const double along_m = dot(to_middle_m, way);
    const double half2 = radius_m * radius_m - dot(to_middle_m, to_middle_m) + along_m * along_m;
    if (half2 <= 0) return;
    const double half_m = std::sqrt(half2);
    const double inside_m = std::min(length_m, along_m + half_m) - std::max(0.0, along_m - half_m);
    if (inside_m <= 0) return;
    for (std::size_t b = 0; b < kTracedBands; ++b) heard[b] += power[b] * inside_m;
  }

  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  Vec3 on_sphere() {
    const double z = 2 * uniform() - 1, turn = 2 * std::numbers::pi * uniform();
    const double flat = std::sqrt(1 - z * z);
    return {flat * std::cos(turn), flat * std::sin(turn), z};
  }
  Vec3 scattered(int axis, double inwards) {
    const double cosine = std::sqrt(uniform()), turn = 2 * std::numbers::pi * uniform();
    const double flat = std::sqrt(1 - cosine * cosine);
    Vec3 way;
    way[axis] = inwards * cosine;
    way[(axis + 1) % 3] = flat * std::cos(turn);
    way[(axis + 2) % 3] = flat * std::sin(turn);
    return way;
  }

  const Rooms rooms_;
  std::mt19937_64 random_;
};

// Nowhere nearer than 0.8 m to a surface: two in sight of the doorway, two beside it.
const std::vector<Vec3> kFarPlaces_m = {
    {8, 1.4, 2.5}, {9.5, 1, 3.9}, {10.8, 1.2, 0.9}, {7, 1.5, 4.2}};

TEST(CoupledRooms, HaveTheLevelOfAnIndependentTracerBeyondTheDoorway) {
  constexpr float kScattering = 0.3f;
  Level level = testing::portal_rooms(false);
  level.materials = {testing::uniform_material(0, kScattering, kMirrorExponent)};
  level.materials[0].absorption = {0.1f, 0.1f, 0.1f, 0.1f, 0.15f, 0.2f, 0.3f, 0.3f};
  DoorwayTracer::Rooms rooms{{12, 2.7, 5},
                             static_cast<double>(testing::kPortalWall_m),
                             2,
                             2.05,
                             2.95,
                             {},
                             {},
                             static_cast<double>(kScattering)};
  for (std::size_t b = 0; b < kTracedBands; ++b) {
    rooms.absorption[b] = static_cast<double>(level.materials[0].absorption[kFirstTraced + b]);
    rooms.air_loss_per_m[b] = static_cast<double>(air_loss_per_m(level.air)[kFirstTraced + b]);
  }
  const auto traced =
      DoorwayTracer(rooms, 1).trace(level.emitters[0].position_m, kFarPlaces_m, 0.4, 50000);

  // By place and band, sums over seeds of the level difference and of its square.
  constexpr std::uint64_t kSeeds = 8;
  std::vector<TracedBands> sum_db(kFarPlaces_m.size()), squares(kFarPlaces_m.size());
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto baked = bake(level, {.settings = {.seed = seed, .photons = 5000, .sources = 5000}});
    ASSERT_TRUE(baked.ok());
    std::vector<Source> sources = baked->octree.sources;
    const auto images = image_sources(baked->images, baked->emitters);
    sources.insert(sources.end(), images.begin(), images.end());
    const OcclusionGeometry surfaces(baked->mesh, baked->materials, sources);
    for (std::size_t p = 0; p < kFarPlaces_m.size(); ++p) {
      TracedBands heard{};
      for (const Arrival& arrival : energy_response(sources, baked->emitters, baked->materials,
                                                    level.air, kFarPlaces_m[p], 0, &surfaces))
        for (std::size_t b = 0; b < kTracedBands; ++b)
          heard[b] += static_cast<double>(arrival.energy[kFirstTraced + b]);
      for (std::size_t b = 0; b < kTracedBands; ++b) {
        const double off_db = 10 * std::log10(heard[b] / traced[p][b]);
        sum_db[p][b] += off_db;
        squares[p][b] += off_db * off_db;
      }
    }
  }
  // Visibility by the share of the Fresnel zone takes up to 0.3 dB. The tracer's own error is 0.15
  // dB at a place.
  for (std::size_t b = 0; b < kTracedBands; ++b) {
    double mean_db = 0, mean_variance = 0;
    for (std::size_t p = 0; p < kFarPlaces_m.size(); ++p) {
      const double off_db = sum_db[p][b] / kSeeds;
      const double variance = (squares[p][b] / kSeeds - off_db * off_db) / (kSeeds - 1);
      mean_db += off_db / static_cast<double>(kFarPlaces_m.size());
      mean_variance += variance / static_cast<double>(kFarPlaces_m.size());
      EXPECT_NEAR(off_db, 0, 0.6 + 4 * std::hypot(0.15, std::sqrt(variance)))
          << kBandCentres_hz[kFirstTraced + b] << " Hz, place " << p;
    }
    RecordProperty("mean_db_" + std::to_string(kFirstTraced + b), std::to_string(mean_db));
    RecordProperty("error_db_" + std::to_string(kFirstTraced + b),
                   std::to_string(std::sqrt(mean_variance)));
    EXPECT_NEAR(mean_db, 0, 0.7) << kBandCentres_hz[kFirstTraced + b] << " Hz";
    EXPECT_LT(std::sqrt(mean_variance), 0.4) << kBandCentres_hz[kFirstTraced + b] << " Hz";
  }
}

// Power of reflections at a place, as zones let it pass and as straight lines would.
struct PassedPower {
  std::array<double, kBandCount> by_zones{}, by_lines{};
  std::array<double, kBandCount> from_elsewhere{};  // by zones, where the line is blocked
  double loss_db(std::size_t band) const {
    return 10 * std::log10(by_zones[band] / by_lines[band]);
  }
};

// An opening lets pass what falls on it, so summed over the reflections behind it, zones and lines
// should pass the same power. Near the sides of an opening, the curve of one edge makes zones pass
// less, and some of it comes from behind the wall. Reflections of the room itself lose nothing.
TEST(CoupledRooms, LoseLittleByZonesAndThroughTheDoorwayAlone) {
  Level level = testing::portal_rooms(false);
  level.materials = {testing::uniform_material(0.1f, 0.3f, kMirrorExponent)};
  const auto baked = bake(level, {.settings = {.photons = 5000, .sources = 10000}});
  ASSERT_TRUE(baked.ok());
  const OcclusionGeometry surfaces(baked->mesh, baked->materials);
  const ReflectionLaws laws(baked->materials);
  const Bands air = air_loss_per_m(level.air);
  std::vector<Vec3> places_m = kFarPlaces_m;
  places_m.emplace_back(6.8, 1.4, 2.5);  // 0.8 m from the doorway
  for (const Vec3& place_m : places_m) {
    std::vector<const Source*> sources;
    for (const Source& source : baked->octree.sources)
      if (!source.is_emitter) sources.push_back(&source);
    const std::vector<Bands> visible =
        fine_visibility(surfaces, speed_of_sound_mps(level.air), sources, place_m);
    PassedPower through, within;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      const Bands power = received_intensity(*sources[i], baked->emitters, laws, air, place_m);
      const auto from_m = surfaces.ray_origin(*sources[i]);
      const bool is_free = from_m && surfaces.is_free(*from_m, Vec3f(place_m));
      PassedPower& passed =
          sources[i]->position_m.x < testing::kPortalWall_m - 0.01f ? through : within;
      for (std::size_t b = 0; b < kBandCount; ++b) {
        passed.by_zones[b] += static_cast<double>(power[b]) * static_cast<double>(visible[i][b]);
        if (is_free)
          passed.by_lines[b] += static_cast<double>(power[b]);
        else
          passed.from_elsewhere[b] +=
              static_cast<double>(power[b]) * static_cast<double>(visible[i][b]);
      }
    }
    std::printf("| %.1f, %.1f, %.1f |", place_m.x, place_m.y, place_m.z);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double elsewhere = through.from_elsewhere[b] / through.by_zones[b];
      std::printf(" %+.1f (%.0f %%, %.0f %%) |", through.loss_db(b),
                  100 * through.by_lines[b] / (through.by_lines[b] + within.by_lines[b]),
                  100 * elsewhere);
      const double all_db = 10 * std::log10((through.by_zones[b] + within.by_zones[b]) /
                                            (through.by_lines[b] + within.by_lines[b]));
      EXPECT_NEAR(all_db, 0, 0.7) << kBandCentres_hz[b] << " Hz";
      EXPECT_LT(elsewhere, 0.6) << kBandCentres_hz[b] << " Hz";
      EXPECT_NEAR(within.loss_db(b), 0, 0.2) << kBandCentres_hz[b] << " Hz";
      EXPECT_LT(through.loss_db(b), 0.5) << kBandCentres_hz[b] << " Hz";
      EXPECT_GT(through.loss_db(b), kBandCentres_hz[b] < 8000 ? -2.6 : -1) << kBandCentres_hz[b];
    }
    std::printf("\n");
  }
}

// --- A closed door -----------------------------------------------------------------------------

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
  std::vector<Source> sources = contents.octree.sources;
  const auto images = image_sources(contents.images, contents.emitters);
  sources.insert(sources.end(), images.begin(), images.end());
  const OcclusionGeometry surfaces(contents.mesh, contents.materials, sources);
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
