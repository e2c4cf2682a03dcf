// Reciprocity: exchanging source and listener leaves the received energy unchanged.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "bake/report/level_report.h"
#include "bake/trace/photon_tracer.h"
#include "bake/trace/scene.h"
#include "common/thread_team.h"
#include "formats/bake_file/expanded_sources.h"
#include "formats/gltf/level_import.h"
#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/image_mirrors.h"
#include "runtime/occlusion/occlusion_geometry.h"
#include "runtime/propagation/received_intensity.h"
#include "runtime/response/energy_response.h"
#include "tests/build_paths.h"
#include "tests/rooms.h"

namespace clamor {
namespace {

constexpr std::size_t kSeeds = 16, kWindows = 10;
constexpr double kWindow_s = 0.02;  // the last window includes all later energy
constexpr std::uint64_t kPhotonsEachWay = 16 * kRunPhotons;
constexpr double kSoundSpeed_mps = 343.2;

// Energy by window and band, with the standard error over independent seeds.
struct DecayWithError {
  std::array<std::array<double, kBandCount>, kWindows> energy{}, error{};
};

// Six walls whose absorption and BRDF differ from each other and between bands.
Level room() {
  Level level = testing::shoebox({6, 5, 3}, {}, {});
  level.mesh = testing::box({6, 5, 3}, {0, 1, 2, 3, 4, 5});
  level.materials.clear();
  for (int wall = 0; wall < 6; ++wall) {
    Material material = testing::uniform_material(0.08f + 0.08f * static_cast<float>(wall));
    material.scattering = same_in_all_bands(0.05f + 0.1f * static_cast<float>(wall));
    material.phong = {0, 0.5f, 1, 2, 5, 10, 20, 50};
    level.materials.push_back(material);
  }
  level.emitters.clear();
  return level;
}

DecayWithError reflected_decay(const Vec3& source_m, const Vec3& listener_m) {
  Level level = room();
  for (std::size_t seed = 0; seed < kSeeds; ++seed) {  // names select the random numbers
    Emitter emitter;
    emitter.name = "source " + std::to_string(seed) + " at " + std::to_string(source_m.x);
    emitter.position_m = source_m;
    level.emitters.push_back(emitter);
  }
  const Scene scene(level.mesh);
  const ReflectionLaws laws(level.materials);
  const Bands air = air_loss_per_m(level.air);
  const PhotonTracer tracer(scene, level, {.speed_mps = kSoundSpeed_mps, .air_loss_per_m = air});
  DecayWithError decay;
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    TracedRuns traced;
    for (std::uint64_t first = 0; first < kPhotonsEachWay; first += kRunPhotons) {
      const PhotonRun run{seed, first, kRunPhotons};
      tracer.trace({&run, 1}, traced);
    }
    std::array<std::array<double, kBandCount>, kWindows> energy{};
    for (const Deposit& deposit : traced.deposits()) {
      const Bands heard =
          received_intensity(secondary_source(deposit, 1), level.emitters, laws, air, listener_m);
      const double time_s = static_cast<double>(deposit.delay_s) +
                            length(listener_m - Vec3(deposit.position_m)) / kSoundSpeed_mps;
      const std::size_t window =
          std::min(kWindows - 1, static_cast<std::size_t>(time_s / kWindow_s));
      for (std::size_t b = 0; b < kBandCount; ++b)
        energy[window][b] += static_cast<double>(heard[b]) / kPhotonsEachWay;
    }
    for (std::size_t w = 0; w < kWindows; ++w)
      for (std::size_t b = 0; b < kBandCount; ++b) {
        decay.energy[w][b] += energy[w][b] / kSeeds;
        decay.error[w][b] += energy[w][b] * energy[w][b] / kSeeds;
      }
  }
  for (std::size_t w = 0; w < kWindows; ++w)
    for (std::size_t b = 0; b < kBandCount; ++b)
      decay.error[w][b] =
          std::sqrt((decay.error[w][b] - decay.energy[w][b] * decay.energy[w][b]) / (kSeeds - 1));
  return decay;
}

TEST(Reciprocity, HoldsForSourceAndListenerExchanged) {
  const Vec3 a_m(0.9, 1.2, 0.7), b_m(4.6, 3.7, 2.2);
  const DecayWithError there = reflected_decay(a_m, b_m), back = reflected_decay(b_m, a_m);
  double worst = 0, squares = 0;
  for (std::size_t w = 0; w < kWindows; ++w)
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double error = std::hypot(there.error[w][b], back.error[w][b]);
      const double z = (there.energy[w][b] - back.energy[w][b]) / error;
      worst = std::max(worst, std::abs(z));
      squares += z * z / (kWindows * kBandCount);
      // Student's distribution with 15 degrees of freedom per side: one value in 7000 exceeds 4.4.
      EXPECT_LT(std::abs(z), 4.4) << "window " << w << ", band " << b;
    }
  // Bands share their paths and windows do not, so these are about ten independent values of mean
  // 1.07.
  EXPECT_LT(squares, 2.5);
  RecordProperty("worst", std::to_string(worst));
  RecordProperty("mean_square", std::to_string(squares));
  // The noise is small enough to detect a BRDF that is not reciprocal.
  for (std::size_t b = 0; b < kBandCount; ++b) {
    EXPECT_LT(there.error[0][b], (b < 6 ? 0.005 : 0.02) * there.energy[0][b]) << "band " << b;
    EXPECT_LT(there.error[4][b], (b < 6 ? 0.04 : 0.1) * there.energy[4][b]) << "band " << b;
  }
}

// Energies from each of some places at each other, of reflections that a straight line of sight
// leads to, with standard errors over independent groups of photons.
struct Exchanged {
  using Energy = std::array<double, kBandCount>;
  std::vector<std::vector<Energy>> energy, error;
};

Exchanged exchanged(Level& level, const std::vector<Vec3>& places_m) {
  constexpr std::size_t kGroups = 8;
  constexpr std::uint64_t kPhotons = 4 * kRunPhotons;
  level.emitters.clear();
  for (std::size_t e = 0; e < places_m.size() * kGroups; ++e) {  // names select the random numbers
    Emitter emitter;
    emitter.name = "group " + std::to_string(e);
    emitter.position_m = places_m[e / kGroups];
    level.emitters.push_back(emitter);
  }
  const Scene scene(level.mesh);
  const ReflectionLaws laws(deposit_materials(level.materials));
  const Bands air = air_loss_per_m(level.air);
  const PhotonTracer tracer(scene, level, {.speed_mps = kSoundSpeed_mps, .air_loss_per_m = air});
  std::vector<std::vector<Exchanged::Energy>> groups(
      level.emitters.size(), std::vector<Exchanged::Energy>(places_m.size()));
  team_for(0, groups.size(), [&](std::size_t e) {
    TracedRuns traced;
    for (std::uint64_t first = 0; first < kPhotons; first += kRunPhotons) {
      const PhotonRun run{static_cast<std::uint32_t>(e), first, kRunPhotons};
      tracer.trace({&run, 1}, traced);
    }
    for (const Deposit& deposit : traced.deposits()) {
      const Vec3f from_m(scene.away_from_surface(Vec3(deposit.position_m), Vec3(deposit.normal)));
      for (std::size_t to = 0; to < places_m.size(); ++to) {
        const Bands heard = received_intensity(secondary_source(deposit, 1), level.emitters, laws,
                                               air, places_m[to]);
        if (to == e / kGroups || scene.is_occluded(from_m, Vec3f(places_m[to]))) continue;
        for (std::size_t b = 0; b < kBandCount; ++b)
          groups[e][to][b] += static_cast<double>(heard[b]) / kPhotons;
      }
    }
  });
  const std::vector<Exchanged::Energy> none(places_m.size());
  Exchanged all{{places_m.size(), none}, {places_m.size(), none}};
  for (std::size_t from = 0; from < places_m.size(); ++from)
    for (std::size_t to = 0; to < places_m.size(); ++to)
      for (std::size_t b = 0; b < kBandCount; ++b) {
        double mean = 0, squares = 0;
        for (std::size_t g = 0; g < kGroups; ++g) {
          const double one = groups[from * kGroups + g][to][b];
          mean += one / kGroups, squares += one * one / kGroups;
        }
        all.energy[from][to][b] = mean;
        all.error[from][to][b] = std::sqrt((squares - mean * mean) / (kGroups - 1));
      }
  return all;
}

// Places in the violin room, some of them low between chairs.
const std::vector<Vec3> kPlacesOfViolinRoom_m = {
    {-2, 1.2, -2.9}, {0.3, 1.5, -2.3}, {-1.2, 0.6, 1.45}, {2.5, 1.3, 4.2}, {3.3, 0.45, 0.3}};

Level violin_room() {
  auto imported = import_level(std::string(testing::kSourceDir) + "/assets/levels/violin_room.glb",
                               ImportOptions());
  EXPECT_TRUE(imported.ok()) << imported.error().message;
  prepare_level(imported->level);
  return std::move(imported->level);
}

// Ten pairs in a furnished room, where a straight line decides what is occluded. (The Fresnel zones
// by which reflections are heard are no such line, see below.)
TEST(Reciprocity, HoldsForTracedPathsInAFurnishedRoom) {
  Level level = violin_room();
  const std::vector<Vec3>& places_m = kPlacesOfViolinRoom_m;
  const Exchanged all = exchanged(level, places_m);
  std::array<double, kBandCount> squares{};
  for (std::size_t i = 0; i < places_m.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      for (std::size_t b = 0; b < kBandCount; ++b) {
        const double there = all.energy[i][j][b], back = all.energy[j][i][b];
        const double db = 10 * std::log10(there / back),
                     error_db = 10 / std::log(10) *
                                std::hypot(all.error[i][j][b] / there, all.error[j][i][b] / back);
        EXPECT_LT(error_db, b < 3 ? 0.4 : 0.6) << i << " and " << j << ", band " << b;
        // Student's distribution with 7 degrees of freedom per side; 80 values, most of them alike.
        EXPECT_LT(std::abs(db), 0.05 + 4.5 * error_db) << i << " and " << j << ", band " << b;
        squares[b] += db * db / 10;
      }
  // Pairs share their places, and so their noise.
  EXPECT_LT(std::sqrt(squares[0]), 0.3);
}

// In a diffuse field, the power that a place receives is proportional to what the zones of all
// directions let pass together: of the first surface, which straight lines see alone, and of those
// behind it. Exchange leaves it unchanged if that is 1 everywhere. Edges take less from a lit
// surface than they add in their shadow, and furniture that a long wave passes reflects it as well.
TEST(Reciprocity, OfFresnelZonesIsOffByWhatTheyPassMoreInOnePlaceThanInAnother) {
  constexpr int kDirections = 512;
  constexpr double kFar_m = 100;
  const Level level = violin_room();
  const OcclusionGeometry surfaces(level.mesh, level.materials);
  std::array<double, kBandCount> least{}, most{};
  for (const Vec3& at_m : kPlacesOfViolinRoom_m) {
    std::array<double, kBandCount> passed{};
    std::uint64_t rays = 0;
    for (int i = 0; i < kDirections; ++i) {
      const double z = 1 - 2 * (i + 0.5) / kDirections, turn = 2 * std::numbers::pi * i,
                   across = std::sqrt(1 - z * z);
      const Vec3 along(across * std::cos(turn * std::numbers::phi),
                       across * std::sin(turn * std::numbers::phi), z);
      for (double from_m = 1e-4; from_m < kFar_m; from_m += 1e-3) {
        const auto hit =
            surfaces.first_level_hit(Vec3f(at_m + from_m * along), Vec3f(at_m + kFar_m * along));
        if (!hit) break;
        from_m += static_cast<double>(hit->fraction) * (kFar_m - from_m);
        Vec3 normal(hit->normal);
        if (dot(normal, along) > 0) normal = -normal;
        const Vec3 start_m = at_m + from_m * along + OcclusionGeometry::kStartOffset_m * normal;
        const Bands passes = fresnel_visibility(
            surfaces, {Vec3f(start_m), Vec3f(at_m), kSoundSpeed_mps}, kMediumPaths, rays);
        for (std::size_t b = 0; b < kBandCount; ++b)
          passed[b] += static_cast<double>(passes[b]) / kDirections;
      }
    }
    std::printf("| %.1f, %.1f, %.1f |", at_m.x, at_m.y, at_m.z);
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double db = 10 * std::log10(passed[b]);
      std::printf(" %+.2f |", db);
      const bool is_first = &at_m == kPlacesOfViolinRoom_m.data();
      least[b] = is_first ? db : std::min(least[b], db);
      most[b] = is_first ? db : std::max(most[b], db);
    }
    std::printf("\n");
  }
  for (std::size_t b = 0; b < kBandCount; ++b) {
    EXPECT_GT(least[b], -0.1) << "band " << b;
    EXPECT_LT(most[b], 1) << "band " << b;
    EXPECT_LT(most[b] - least[b], 0.65) << "band " << b;
  }
}

// Where the image of another source would be, whose path to the listener of this one is the same.
std::vector<Vec3> exchanged_images_m(const OcclusionGeometry& surfaces, const Source& image,
                                     Vec3 listener_m) {
  std::vector<Vec3> all_m;
  for (const MirrorSeries& series : surfaces.mirrors_of(image.position_m, image.original_m)) {
    Vec3& image_m = all_m.emplace_back(listener_m);
    for (std::size_t k = series.order; k-- > 0;) image_m = series.planes[k].image_of(image_m);
  }
  return all_m;
}

// Direct sounds and image sources have no noise. An image that is one from both ends is heard alike
// from both, but for the rounding of its place; where it is left to photons from one end, only sums
// with these could be compared.
class RoomOfFivePlaces {
 public:
  RoomOfFivePlaces() : level_(violin_room()) {
    const std::uint32_t signal = level_.emitters.at(0).signal;
    level_.emitters.clear();
    for (std::size_t i = 0; i < places_m_.size(); ++i) {
      Emitter& emitter = level_.emitters.emplace_back();
      emitter.name = "place " + std::to_string(i);
      emitter.position_m = places_m_[i];
      emitter.signal = signal;
    }
    baked_ = std::move(*bake(level_, {.settings = {.photons = 1000, .sources = 1000}}));
    images_ = image_sources(baked_.images, baked_.emitters);
    surfaces_.emplace(baked_.mesh, baked_.materials, images_);
  }

  const std::vector<Vec3>& places_m() const { return places_m_; }

  Source direct(std::size_t from) const {
    return *std::ranges::find_if(baked_.octree.sources, [&](const Source& source) {
      return source.is_emitter && source.emitter == from;
    });
  }
  // The images by the same mirrors of each of two places.
  std::vector<std::array<const Source*, 2>> images_of_both(std::size_t i, std::size_t j) const {
    std::vector<std::array<const Source*, 2>> pairs;
    std::set<const Source*> known;
    for (const Source& image : images_) {
      if (image.emitter != i) continue;
      const auto all_m = exchanged_images_m(*surfaces_, image, places_m_[j]);
      const auto same = std::ranges::find_if(images_, [&](const Source& other) {
        return other.emitter == j && !known.contains(&other) &&
               std::ranges::any_of(all_m, [&](const Vec3& image_m) {
                 return length(Vec3(other.position_m) - image_m) < 0.03;
               });
      });
      if (same == images_.end()) continue;
      known.insert(&*same);
      pairs.push_back({&image, &*same});
    }
    return pairs;
  }
  Exchanged::Energy heard(const Source& source, std::size_t to) const {
    Exchanged::Energy energy{};
    for (const Arrival& arrival : energy_response({&source, 1}, baked_.emitters, baked_.materials,
                                                  level_.air, places_m_[to], {}, &*surfaces_))
      for (std::size_t b = 0; b < kBandCount; ++b)
        energy[b] += static_cast<double>(arrival.energy[b]);
    return energy;
  }

 private:
  const std::vector<Vec3>& places_m_ = kPlacesOfViolinRoom_m;
  Level level_;
  BakeContents baked_;
  std::vector<Source> images_;
  std::optional<OcclusionGeometry> surfaces_;
};

TEST(Reciprocity, OfDirectSoundsAndImagesHoldsInAFurnishedRoom) {
  // Root mean square over ten pairs. Next to the rim of a rug, a path meets it from one end and the
  // floor from the other, which makes 1.9 dB at 8 kHz at one pair.
  constexpr Exchanged::Energy kWithin_db = {0.2, 0.2, 0.2, 0.2, 0.3, 0.4, 0.45, 0.6};
  const RoomOfFivePlaces room;
  Exchanged::Energy squares{}, worst_db{};
  for (std::size_t i = 0; i < room.places_m().size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      Exchanged::Energy there = room.heard(room.direct(i), j), back = room.heard(room.direct(j), i);
      for (std::size_t b = 0; b < kBandCount; ++b)
        EXPECT_NEAR(there[b] / back[b], 1, 1e-3) << i << " and " << j << ", band " << b;
      for (const auto& [image, same] : room.images_of_both(i, j)) {
        const auto one = room.heard(*image, j), other = room.heard(*same, i);
        for (std::size_t b = 0; b < kBandCount; ++b) there[b] += one[b], back[b] += other[b];
      }
      for (std::size_t b = 0; b < kBandCount; ++b) {
        const double db = 10 * std::log10(there[b] / back[b]);
        squares[b] += db * db / 10;
        worst_db[b] = std::max(worst_db[b], std::abs(db));
      }
    }
  std::printf("| direct and images |");
  for (std::size_t b = 0; b < kBandCount; ++b) {
    std::printf(" %.2f, %.2f |", std::sqrt(squares[b]), worst_db[b]);
    EXPECT_LT(std::sqrt(squares[b]), kWithin_db[b]) << "band " << b;
  }
  std::printf("\n");
}

}  // namespace
}  // namespace clamor
