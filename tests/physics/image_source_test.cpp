// Early specular paths against image sources that are found by other means: in closed form in a
// box, and by trying all sequences of walls in a room with twelve.
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <memory>
#include <numbers>
#include <optional>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "bake/bake.h"
#include "common/air.h"
#include "common/sample_rate.h"
#include "formats/bake_file/expanded_sources.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/response/energy_response.h"
#include "runtime/response/impulse_response.h"
#include "tests/rooms.h"
#include "tests/temporary_file.h"

namespace clamor {
namespace {

constexpr std::size_t kOrder = 3;

// A specular path to the listener: its length, and the share of the power that its walls reflect.
struct Reflection {
  Vec3 image_m{};
  double path_m = 0;
  Bands share{};
  int order = 0;
};

Bands times(const Bands& a, const Bands& b) {
  Bands product = a;
  for (std::size_t i = 0; i < kBandCount; ++i) product[i] *= b[i];
  return product;
}

Bands reflected_by(const Material& material) {
  Bands share{};
  for (std::size_t b = 0; b < kBandCount; ++b)
    share[b] = (1 - material.absorption[b]) * (1 - material.scattering[b]);
  return share;
}

// A convex room of flat walls.
struct Wall {
  Vec3 corner_m{}, normal{};  // inwards
  std::uint16_t material = 0;
};

std::vector<Wall> walls_of(const Mesh& mesh) {
  Vec3 middle_m{};
  for (const Vec3f& vertex : mesh.vertices_m)
    middle_m += Vec3(vertex) / static_cast<double>(mesh.vertices_m.size());
  std::vector<Wall> walls;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corners = mesh.triangles[t];
    const Vec3 a(mesh.vertices_m[corners[0]]), b(mesh.vertices_m[corners[1]]),
        c(mesh.vertices_m[corners[2]]);
    Vec3 normal = normalize(cross(b - a, c - a));
    if (dot(middle_m - a, normal) < 0) normal = -normal;
    const bool is_known = std::ranges::any_of(walls, [&](const Wall& wall) {
      return dot(wall.normal, normal) > 1 - 1e-9 && std::abs(dot(a - wall.corner_m, normal)) < 1e-5;
    });
    if (!is_known) walls.push_back({a, normal, mesh.materials[t]});
  }
  return walls;
}

// All specular paths of a convex room, by trying all sequences of walls. In a convex room a path is
// there if each of its points is on the inner side of all other walls.
std::vector<Reflection> reflections_of(const Level& level, const Vec3& listener_m,
                                       std::size_t order = kOrder) {
  const std::vector<Wall> walls = walls_of(level.mesh);
  std::vector<Reflection> found;
  std::vector<std::size_t> sequence;
  const auto try_path = [&] {
    std::vector<Vec3> images_m = {level.emitters[0].position_m};
    for (const std::size_t w : sequence) {
      const Vec3& last_m = images_m.back();
      images_m.push_back(last_m +
                         walls[w].normal * (2 * dot(walls[w].corner_m - last_m, walls[w].normal)));
    }
    Vec3 from_m = listener_m;
    Bands share = same_in_all_bands(1);
    for (std::size_t k = sequence.size(); k-- > 0;) {
      const Wall& wall = walls[sequence[k]];
      const Vec3 along_m = images_m[k + 1] - from_m;
      const double towards = dot(along_m, wall.normal);
      if (!(towards < 0)) return;
      const double fraction = dot(wall.corner_m - from_m, wall.normal) / towards;
      if (!(fraction > 0 && fraction < 1)) return;
      const Vec3 point_m = from_m + along_m * fraction;
      for (std::size_t w = 0; w < walls.size(); ++w)
        if (w != sequence[k] && dot(point_m - walls[w].corner_m, walls[w].normal) < 0) return;
      share = times(share, reflected_by(level.materials[wall.material]));
      from_m = point_m;
    }
    found.push_back({images_m.back(), length(listener_m - images_m.back()), share,
                     static_cast<int>(sequence.size())});
  };
  const auto extend = [&](const auto& self) -> void {
    if (!sequence.empty()) try_path();
    if (sequence.size() == order) return;
    for (std::size_t w = 0; w < walls.size(); ++w) {
      if (!sequence.empty() && sequence.back() == w) continue;
      sequence.push_back(w);
      self(self);
      sequence.pop_back();
    }
  };
  extend(extend);
  std::ranges::sort(found, {}, &Reflection::path_m);
  return found;
}

// A prism of ten uneven side walls.
Mesh twelve_walls() {
  Mesh mesh;
  constexpr int kSides = 10;
  for (int i = 0; i < kSides; ++i) {
    const double turn = 2 * std::numbers::pi * (i + 0.22 * std::sin(5.0 * i)) / kSides;
    const Vec3 at_m(6 * std::cos(turn), 4.5 * std::sin(turn), 0);
    mesh.vertices_m.emplace_back(at_m);
    mesh.vertices_m.emplace_back(at_m + Vec3(0, 0, 3.4));
  }
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint16_t material) {
    mesh.triangles.push_back({a, b, c});
    mesh.materials.push_back(material);
  };
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t j = (i + 1) % kSides;
    const auto material = static_cast<std::uint16_t>(i % 2);
    add(2 * i, 2 * j, 2 * j + 1, material);
    add(2 * i, 2 * j + 1, 2 * i + 1, material);
    if (i == 0 || j == 0) continue;
    add(0, 2 * i, 2 * j, 0);
    add(1, 2 * i + 1, 2 * j + 1, 1);
  }
  return mesh;
}

struct Played {
  Level level;
  std::shared_ptr<const BakeFile> file;
  std::vector<Source> sources;
  std::unique_ptr<OcclusionGeometry> surfaces;
  Mesh mesh;  // as stored

  Played(const Level& of, std::uint64_t seed, std::uint64_t count = 2000) : level(of) {
    BakeOptions options;
    options.settings = {.seed = seed, .sources = count, .early_order = static_cast<int>(kOrder)};
    const auto contents = bake(level, options);
    EXPECT_TRUE(contents.ok()) << contents.error().message;
    file = testing::as_file(*contents);
    auto all = read_expanded_sources(*file);
    EXPECT_TRUE(all.ok());
    sources = std::move(all->sources);
    auto stored = file->read_mesh();
    EXPECT_TRUE(stored.ok());
    mesh = std::move(*stored);
    surfaces = std::make_unique<OcclusionGeometry>(mesh, file->materials(), sources);
  }
  std::vector<Arrival> arrivals(const Vec3& listener_m) const {
    return energy_response(sources, file->emitters(), file->materials(), level.air, listener_m,
                           std::nullopt, surfaces.get());
  }
};

bool has(const std::vector<Reflection>& paths, const Vec3& image_m, double within_m = 0.01) {
  return std::ranges::any_of(
      paths, [&](const Reflection& one) { return length(one.image_m - image_m) < within_m; });
}

// Compares what arrives before any path with more reflections than kOrder could.
void expect_reflections(const Played& played, const Vec3& listener_m) {
  const double speed_mps = speed_of_sound_mps(played.level.air);
  const Bands loss_per_m = air_loss_per_m(played.level.air);
  auto arrivals = played.arrivals(listener_m);
  const auto expected = reflections_of(played.level, listener_m);
  ASSERT_GT(expected.size(), 20u);
  // At the edges of mirrors, images fade where both ends move by 0.075 m: as much at a mirror half
  // way as the listener alone by 0.15 m, and nearer to the source less.
  constexpr double kFade_m = 0.15, kSourceFade_m = 0.075;
  std::vector<std::vector<Reflection>> nearby, from_nearby;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 aside(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    nearby.push_back(reflections_of(played.level, listener_m + kFade_m * aside));
    Level moved = played.level;
    moved.emitters[0].position_m += kSourceFade_m * aside;
    from_nearby.push_back(reflections_of(moved, listener_m));
  }
  std::vector<bool> is_matched(arrivals.size());
  std::size_t compared = 0;
  for (const Reflection& one : expected) {
    if (!std::ranges::all_of(nearby, [&](const auto& paths) { return has(paths, one.image_m); }) ||
        !std::ranges::all_of(from_nearby, [&](const auto& paths) {
          return has(paths, one.image_m, std::sqrt(3) * kSourceFade_m + 0.01);
        }))
      continue;
    ++compared;
    Bands energy{};
    for (std::size_t b = 0; b < kBandCount; ++b)
      energy[b] = static_cast<float>(one.share[b] *
                                     std::exp(-static_cast<double>(loss_per_m[b]) * one.path_m) /
                                     (one.path_m * one.path_m));
    bool is_found = false;
    for (std::size_t i = 0; i < arrivals.size() && !is_found; ++i) {
      if (is_matched[i] || arrivals[i].polarity != 1 ||
          std::abs(arrivals[i].time_s - one.path_m / speed_mps) > 1.0 / kSampleRate_hz)
        continue;
      is_found = true;
      for (std::size_t b = 0; b < kBandCount; ++b)
        is_found &= std::abs(10 * std::log10(arrivals[i].energy[b] / energy[b])) < 0.25;
      is_matched[i] = is_found;
    }
    EXPECT_TRUE(is_found) << "order " << one.order << ", " << one.path_m << " m";
  }
  EXPECT_GT(compared, expected.size() * 9 / 10);
  // Where nothing is scattered, nothing else arrives before the first path with more reflections
  // than kOrder: photons leave nothing on the paths of images.
  if (std::ranges::all_of(played.level.materials,
                          [](const Material& one) { return one.scattering == Bands{}; })) {
    double first_later_m = 1e9;
    for (const Reflection& one : reflections_of(played.level, listener_m, kOrder + 1))
      if (one.order > static_cast<int>(kOrder)) first_later_m = std::min(first_later_m, one.path_m);
    const double direct_m = length(listener_m - played.level.emitters[0].position_m);
    const double least = 1e-4 * kBandCount / (direct_m * direct_m);  // -40 dB
    for (std::size_t i = 0; i < arrivals.size(); ++i) {
      if (is_matched[i] || arrivals[i].time_s > (first_later_m - 0.01) / speed_mps ||
          std::abs(arrivals[i].time_s - direct_m / speed_mps) < 1e-6)
        continue;
      EXPECT_LT(static_cast<double>(sum_of(arrivals[i].energy)), least)
          << arrivals[i].time_s * speed_mps << " m";
    }
  }
  // No image is heard that is none.
  std::uint64_t rays = 0;
  for (const Source& source : played.sources) {
    if (!source.is_image ||
        source_visibility(*played.surfaces, speed_mps, source, listener_m, 1, rays) == Bands{})
      continue;
    EXPECT_TRUE(has(expected, Vec3(source.position_m)) ||
                std::ranges::any_of(
                    nearby, [&](const auto& paths) { return has(paths, Vec3(source.position_m)); }))
        << length(listener_m - Vec3(source.position_m)) << " m";
  }
}

TEST(ImageSources, OfABoxArriveInTimeAndWithTheirLevels) {
  Level level = testing::shoebox({7, 5, 3}, testing::uniform_material(0.05f, 0, kMirrorExponent),
                                 {2.1, 1.3, 1.2});
  level.materials.push_back(testing::uniform_material(0, 0, kMirrorExponent));
  level.materials[1].absorption = {0.02f, 0.05f, 0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f};
  for (std::size_t t = 0; t < 6; ++t)
    level.mesh.materials[2 * t] = level.mesh.materials[2 * t + 1] =
        static_cast<std::uint16_t>(t % 2);
  for (const std::uint64_t seed : {1, 2}) {
    const Played played(level, seed);
    for (const Vec3& listener_m : {Vec3(5.2, 3.7, 1.7), Vec3(3.3, 0.6, 2.4), Vec3(6.6, 4.5, 0.4)})
      expect_reflections(played, listener_m);
  }
}

TEST(ImageSources, OfARoomWithTwelveWallsAreThoseOfAllSequencesOfWalls) {
  Level level = testing::shoebox({1, 1, 1}, testing::uniform_material(0.1f, 0.1f, kMirrorExponent),
                                 {1.5, 0.7, 1.2});
  level.materials.push_back(testing::uniform_material(0.3f, 0, kMirrorExponent));
  level.mesh = twelve_walls();
  for (const std::uint64_t seed : {1, 5}) {
    const Played played(level, seed);
    for (const Vec3& listener_m : {Vec3(-2.5, -1.1, 1.7), Vec3(-3.2, 1.4, 0.9)})
      expect_reflections(played, listener_m);
  }
}

// The waveform over a floor, against the sum of direct and reflected pressure at each frequency.
TEST(ImageSources, OfAFloorInterfereWithTheDirectSound) {
  constexpr std::size_t kFrames = 1 << 12;
  for (const auto& [source_m, distance_m, absorption] : {std::tuple(1.5, 20.0, 0.0f),
                                                         {1.5, 20.0, 0.4f},
                                                         {0.5, 5.0, 0.0f},
                                                         {0.5, 5.0, 0.4f},
                                                         {2.5, 8.0, 0.0f},
                                                         {2.5, 8.0, 0.75f},
                                                         {1.0, 2.0, 0.0f},
                                                         {1.0, 2.0, 0.4f}}) {
    Level level = testing::shoebox(
        {1, 1, 1}, testing::uniform_material(absorption, 0, kMirrorExponent), {0, source_m, 0});
    level.air = {20, 50, 101.325};
    level.mesh = {};
    testing::add_quad(level.mesh,
                      {Vec3f(-40, 0, -40), Vec3f(60, 0, -40), Vec3f(60, 0, 40), Vec3f(-40, 0, 40)});
    const Vec3 listener_m(distance_m, 1.5, 0);
    const double direct_m = length(listener_m - Vec3(0, source_m, 0));
    const double reflected_m = length(listener_m - Vec3(0, -source_m, 0));
    const double speed_mps = speed_of_sound_mps(level.air);
    for (const std::uint64_t seed : {1, 7}) {
      const Played played(level, seed, 500);
      const auto waveform = impulse_response(played.arrivals(listener_m), kFrames);
      for (std::size_t b = 0; b + 1 < kBandCount; ++b) {
        const double loss = static_cast<double>(air_loss_per_m(level.air)[b]) / 2;
        double heard = 0, expected = 0;
        for (double hz = kBandCentres_hz[b] / std::numbers::sqrt2;
             hz < kBandCentres_hz[b] * std::numbers::sqrt2; hz += kBandCentres_hz[b] / 50) {
          const double turn = 2 * std::numbers::pi * hz;
          std::complex<double> sum = 0;
          for (std::size_t i = 0; i < kFrames; ++i)
            sum += static_cast<double>(waveform[i]) *
                   std::polar(1.0, -turn * static_cast<double>(i) / kSampleRate_hz);
          heard += std::norm(sum);
          expected += std::norm(
              std::polar(std::exp(-loss * direct_m) / direct_m, -turn * direct_m / speed_mps) +
              std::polar(std::sqrt(1 - absorption) * std::exp(-loss * reflected_m) / reflected_m,
                         -turn * reflected_m / speed_mps));
        }
        EXPECT_NEAR(10 * std::log10(heard / expected), 0, 0.5)
            << kBandCentres_hz[b] << " Hz, " << distance_m << " m, seed " << seed;
      }
    }
  }
}

}  // namespace
}  // namespace clamor
