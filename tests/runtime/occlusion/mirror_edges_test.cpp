// mirror_edges_test.cpp: diffraction of image sources, against exact solutions.
#include "runtime/occlusion/mirror_edges.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "runtime/occlusion/diffraction_paths.h"
#include "runtime/occlusion/image_path.h"
#include "tests/mirror_images.h"
#include "tests/rooms.h"
#include "tests/runtime/occlusion/half_plane_reference.h"

namespace clamor {
namespace {

using testing::Complex;
using testing::kPi;
using testing::kSound_mps;

double image_db(double power) { return 10 * std::log10(std::max(power, 1e-12)); }

std::vector<Material> mirrors() { return {testing::uniform_material(0, 0, kMirrorExponent)}; }

double wave_number_of(std::size_t tone) {
  return 2 * kPi * 62.5 * std::exp2((static_cast<double>(tone) - 1) / 3) / kSound_mps;
}

DirectSound image_of(const OcclusionGeometry& geometry, const Vec3& source_m, const Vec3& image_m,
                     const Vec3& to_m) {
  Source image;
  image.is_emitter = image.is_image = true;
  image.position_m = Vec3f(image_m);
  image.original_m = Vec3f(source_m);
  std::uint64_t rays = 0;
  return image_sound(geometry, image, {image.position_m, Vec3f(to_m), kSound_mps}, rays);
}

// Pressure of the direct sound with all edges, relative to a free field.
Tones direct_pressure(const OcclusionGeometry& geometry, const Vec3& from_m, const Vec3& to_m) {
  std::uint64_t rays = 0;
  std::vector<EdgeBetween> found;
  geometry.find_edges(from_m, to_m, 64, 40, found);
  const DiffractionPaths paths(geometry, from_m, to_m, kSound_mps, std::move(found), true, rays);
  Tones sum{};
  if (geometry.is_free(Vec3f(from_m), Vec3f(to_m))) sum.fill(1);
  for (const EdgeSound& sound : paths.sounds())
    for (std::size_t i = 0; i < kTones; ++i) sum[i] += sound.pressure[i];
  return sum;
}

// The largest change of a band's level between two places, of what is above `floor_db`.
double largest_step_db(const Bands& a, const Bands& b, double floor_db) {
  const double least = std::pow(10, floor_db / 10);
  double largest = 0;
  for (std::size_t i = 0; i < kBandCount; ++i)
    largest = std::max(largest, std::abs(image_db(std::max<double>(a[i], least)) -
                                         image_db(std::max<double>(b[i], least))));
  return largest;
}

// The whole field, from before the half-plane, where its image is heard, over the edge and into its
// shadow.
TEST(ImageDiffraction, AddsUpWithDirectSoundToTheExactFieldOfAHalfPlane_NoAsan) {
  const OcclusionGeometry geometry(testing::half_plane(), mirrors());
  for (const Vec3 from : {Vec3(-3, -0.5, 0.6), Vec3(-2, -4, 0.6)}) {
    const Vec3 image(-from.x, from.y, from.z);
    const bool is_grazing = from.y < -1;
    Bands last{};
    for (int i = 0; i < 200; i += is_grazing ? 10 : 1) {
      const double turn = (20 + 1.5 * i) * kPi / 180;
      const Vec3 to(-2 * std::sin(turn), -2 * std::cos(turn), -0.4);
      const Tones direct = direct_pressure(geometry, from, to);
      const DirectSound reflected = image_of(geometry, from, image, to);
      const double direct_m = length(to - from), image_m = length(to - image);
      for (std::size_t b = 0; b < kBandCount; ++b) {
        double exact = 0, power = 0;
        for (std::size_t t = 3 * b; t < 3 * b + 3; ++t) {
          const double k = wave_number_of(t);
          exact += std::norm(testing::exact_pressure(from, to, k)) * direct_m * direct_m / 3;
          power += std::norm(direct[t] * std::polar(1.0, k * direct_m) +
                             reflected.pressure[t] * std::polar(direct_m / image_m, k * image_m)) /
                   3;
        }
        if (image_db(exact) < -30) continue;
        EXPECT_NEAR(image_db(power), image_db(exact), 1) << b << " at " << turn * 180 / kPi;
      }
      if (i > 0 && !is_grazing) {
        // 3 dB in 28 mm, as the steps are 52 mm.
        EXPECT_LT(largest_step_db(reflected.visibility, last, -30), 5.5) << turn * 180 / kPi;
      }
      last = reflected.visibility;
    }
  }
}

// A plane wave and a rigid wedge of 90 degrees: p = 2 nu sum eps_n i^(-nu n) J(k r) cos cos, of
// order nu n (Bowman et al., section 6.2).
Complex exact_wedge_pressure(double from_rad, double r_to_m, double to_rad, double k) {
  constexpr double kNu = 2.0 / 3;
  Complex sum = 0;
  for (int n = 0; kNu * n < k * r_to_m + 40; ++n)
    sum += (n == 0 ? 1.0 : 2.0) *
           std::polar(std::cyl_bessel_j(kNu * n, k * r_to_m), -kPi / 2 * kNu * n) *
           std::cos(kNu * n * from_rad) * std::cos(kNu * n * to_rad);
  return 2 * kNu * sum;
}

// From one face to the other.
TEST(ImageDiffraction, AddsUpWithDirectSoundToTheExactFieldOfAWedge_NoAsan) {
  Mesh mesh;
  testing::add_quad(
      mesh, {Vec3f(0, 0, -500), Vec3f(0, 0, 500), Vec3f(1000, 0, 500), Vec3f(1000, 0, -500)});
  testing::add_quad(
      mesh, {Vec3f(0, 0, -500), Vec3f(0, 0, 500), Vec3f(0, -1000, 500), Vec3f(0, -1000, -500)});
  const OcclusionGeometry geometry(mesh, mirrors());
  constexpr double kFar_m = 150, kNear = 1.5;
  for (const double from_deg : {60.0, 80.0, 120.0}) {
    const double from_rad = from_deg * kPi / 180;
    const Vec3 from(kFar_m * std::cos(from_rad), kFar_m * std::sin(from_rad), 0);
    const Vec3 images_m[] = {{from.x, -from.y, 0}, {-from.x, from.y, 0}};
    for (double to_deg = 2.5; to_deg < 268; to_deg += 7) {
      const double to_rad = to_deg * kPi / 180;
      const Vec3 to(kNear * std::cos(to_rad), kNear * std::sin(to_rad), 0);
      const Tones direct = direct_pressure(geometry, from, to);
      DirectSound reflected[2];
      for (std::size_t i = 0; i < (from_deg > 90 ? 2u : 1u); ++i)
        reflected[i] = image_of(geometry, from, images_m[i], to);
      for (std::size_t b = 0; b < 6; ++b) {
        double exact = 0, power = 0;
        for (std::size_t t = 3 * b; t < 3 * b + 3; ++t) {
          const double k = wave_number_of(t);
          exact += std::norm(exact_wedge_pressure(from_rad, kNear, to_rad, k)) / 3;
          Complex sum = direct[t] * std::polar(kFar_m / length(to - from), k * length(to - from));
          for (std::size_t i = 0; i < 2; ++i)
            sum += reflected[i].pressure[t] *
                   std::polar(kFar_m / length(to - images_m[i]), k * length(to - images_m[i]));
          power += std::norm(sum) / 3;
        }
        EXPECT_NEAR(image_db(power), image_db(exact), 1.5)
            << b << " from " << from_deg << " to " << to_deg;
      }
    }
  }
}

// In the mirror, a screen that stands on a rigid floor goes on below it.
TEST(ImageDiffraction, BehindAScreenOnAFloorIsThatOfTheMirroredSourceBehindATwiceAsHighOne) {
  for (const float height_m : {1.0f, 2.0f}) {
    Mesh floor, twice;
    testing::add_quad(floor,
                      {Vec3f(-90, 0, -90), Vec3f(90, 0, -90), Vec3f(90, 0, 90), Vec3f(-90, 0, 90)});
    testing::add_quad(floor, {Vec3f(0, 0, -80), Vec3f(0, height_m, -80), Vec3f(0, height_m, 80),
                              Vec3f(0, 0, 80)});
    testing::add_quad(twice, {Vec3f(0, -height_m, -80), Vec3f(0, height_m, -80),
                              Vec3f(0, height_m, 80), Vec3f(0, -height_m, 80)});
    const OcclusionGeometry on_floor(floor, mirrors()), without(twice, mirrors());
    for (const double source_y : {0.5, 1.5})
      for (const double x : {0.5, 1.0, 2.0, 4.0})
        for (const double y : {0.3, 1.2, 1.7, 2.5}) {
          const Vec3 image(-3, -source_y, 0.3), to(x, y, -0.2);
          const Tones reflected = image_of(on_floor, {-3, source_y, 0.3}, image, to).pressure;
          const Bands expected = power_of(direct_pressure(without, image, to));
          const Bands power = power_of(reflected);
          for (std::size_t b = 0; b < kBandCount; ++b) {
            if (image_db(static_cast<double>(expected[b])) < -30) continue;
            EXPECT_NEAR(image_db(static_cast<double>(power[b])),
                        image_db(static_cast<double>(expected[b])), 0.5)
                << b << " at " << x << ", " << y << " behind " << height_m;
          }
        }
  }
}

void add(Mesh& mesh, const Mesh& other, const Vec3f& at_m) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  for (const Vec3f& vertex_m : other.vertices_m) mesh.vertices_m.push_back(vertex_m + at_m);
  for (const auto& [a, b, c] : other.triangles) {
    mesh.triangles.push_back({first + a, first + b, first + c});
    mesh.materials.push_back(0);
  }
}

// At 1.4 m/s, 28 mm are 20 ms.
TEST(ImageDiffraction, ChangesSmoothlyOnAWalkPastPanelsAndAColumn) {
  Mesh sheet, plate, small_plate, with_column;
  for (Mesh* mesh : {&sheet, &with_column})
    testing::add_quad(*mesh, {Vec3f(-2, 0, -2), Vec3f(2, 0, -2), Vec3f(2, 0, 2), Vec3f(-2, 0, 2)});
  add(with_column, box_mesh({0.15, 1.5, 0.15}, 0), {1, 1.5, 0.5});
  add(plate, box_mesh({2, 0.05, 2}, 0), {0, -0.05f, 0});
  add(small_plate, box_mesh({0.5, 0.02, 0.5}, 0), {0, -0.02f, 0});
  for (const Mesh* mesh : {&sheet, &plate, &small_plate, &with_column}) {
    const OcclusionGeometry geometry(*mesh, mirrors());
    Bands last{};
    for (double x = -1; x < 8; x += 0.028) {
      const Vec3 to(x, 1.7, mesh == &with_column ? 1.5 : 0.13);
      const Bands power = image_of(geometry, {0, 2, 0}, {0, -2, 0}, to).visibility;
      if (x > -1) {
        EXPECT_LT(largest_step_db(power, last, -30), 3) << x;
      }
      last = power;
    }
  }
}

// Also where the path begins to meet the mirrors of a corner in the other order.
TEST(ImageDiffraction, OfTwoAndThreeReflectionsHasNoStepsOnAWalkPastTheirMirrors_NoAsan) {
  const auto across_x = [](Mesh& mesh, float x, float from, float to) {
    testing::add_quad(
        mesh, {Vec3f(x, from, from), Vec3f(x, to, from), Vec3f(x, to, to), Vec3f(x, from, to)});
  };
  Mesh wall_and_plate, plates, corner;
  across_x(wall_and_plate, 0, -90, 90);
  across_x(wall_and_plate, 3, 0.5f, 2.5f);
  across_x(plates, 0, -1, 1);
  across_x(plates, 3, 0.2f, 2.2f);
  across_x(corner, 0, 0, 3);
  testing::add_quad(corner, {Vec3f(0, 0, 0), Vec3f(4, 0, 0), Vec3f(4, 0, 3), Vec3f(0, 0, 3)});
  const MirrorPlane left{{1, 0, 0}, 0}, right{{-1, 0, 0}, -3}, floor{{0, 1, 0}, 0};
  struct Case {
    const Mesh& mesh;
    std::vector<std::vector<MirrorPlane>> series;
    Vec3 source_m, from_m, to_m;
  };
  const Case cases[] = {
      {wall_and_plate, {{left, right}}, {1.5, -1.5, 0.9}, {1, -1, 1.1}, {1, 6, 1.1}},
      {wall_and_plate, {{right, left}}, {1.5, -1.5, 0.9}, {1, -1, 1.1}, {1, 6, 1.1}},
      {wall_and_plate, {{left, right, left}}, {1.5, -1.5, 0.9}, {1, -1, 1.1}, {1, 7, 1.1}},
      {plates, {{left, right}}, {1.5, -1.5, 0.6}, {1, -1, 0.4}, {1, 6, 0.4}},
      {corner, {{left, floor}, {floor, left}}, {2, 1, 1}, {0.3, 3, 1.6}, {3, 0.3, 1.6}}};
  for (const Case& one : cases) {
    std::vector<Source> images;
    for (const auto& series : one.series) {
      const auto more = testing::images_by(series, one.source_m);
      images.insert(images.end(), more.begin(), more.end());
    }
    const OcclusionGeometry geometry(one.mesh, mirrors(), images);
    std::uint64_t rays = 0;
    Bands last{};
    const int steps = static_cast<int>(length(one.to_m - one.from_m) / 0.004);
    for (int i = 0; i <= steps; ++i) {
      const Vec3 to_m = one.from_m + i / static_cast<double>(steps) * (one.to_m - one.from_m);
      const Bands power = image_sound(geometry, images.back(),
                                      {images.back().position_m, Vec3f(to_m), kSound_mps}, rays)
                              .visibility;
      if (i > 0) {
        EXPECT_LT(largest_step_db(power, last, -30), 1) << &one - cases << " at " << to_m.y;
      }
      last = power;
    }
  }
}

// Beyond the panel, its sound comes from the border, later and in the direction in which the image
// sends it there.
TEST(ImageDiffraction, IsHeardFromTheBorderBeyondThePanel) {
  Mesh mesh;
  testing::add_quad(mesh,
                    {Vec3f(-50, 0, -50), Vec3f(2, 0, -50), Vec3f(2, 0, 50), Vec3f(-50, 0, 50)});
  auto materials = mirrors();
  const Vec3 from(0, 2, 0), image(0, -2, 0), to(6, 2, 0), border(2, 0, 0);
  const DirectSound sound = image_of(OcclusionGeometry(mesh, materials), from, image, to);
  ASSERT_TRUE(sound.bent);
  const Vec3 heard_at_m(sound.bent->heard_at_m);
  EXPECT_NEAR(length(heard_at_m - to), length(border - image) + length(border - to), 0.02);
  EXPECT_GT(dot(normalize(heard_at_m - to), normalize(border - to)), 0.999);
  EXPECT_GT(dot(Vec3(sound.bent->leaves), normalize(border - image)), 0.999);
  // The border diffracts nothing of what the panel absorbs.
  materials[0].absorption = same_in_all_bands(0.5f);
  const DirectSound less = image_of(OcclusionGeometry(mesh, materials), from, image, to);
  for (std::size_t b = 0; b < kBandCount; ++b)
    EXPECT_NEAR(less.visibility[b], 0.5f * sound.visibility[b], 1e-6);
}

// Corners that point into a room are no edges.
TEST(ImageDiffraction, IsNoneInAClosedRoom) {
  const OcclusionGeometry geometry(testing::box({5, 4, 3}), mirrors());
  for (const Vec3 to : {Vec3(4, 3, 2), Vec3(0.05, 0.05, 0.05), Vec3(4.9, 2, 1)})
    EXPECT_EQ(image_of(geometry, {1, 1, 1}, {-1, 1, 1}, to).visibility, same_in_all_bands(1));
}

}  // namespace
}  // namespace clamor
