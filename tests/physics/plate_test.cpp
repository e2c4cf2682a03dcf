// plate_test.cpp: reflections by rigid plates, one after the other, against the exact solution.
//
// A rigid sheet scatters the field of a double layer, the jump of pressure between its sides: p =
// integral of jump dG/dn, G = exp(i k R) / (4 pi R). Its normal velocity is opposite to that of the
// incident sound on the sheet. Boundary elements solve this for the jump: rectangles that become
// narrower towards the border. The singular part of the kernel, (1 - i k R) exp(i k R) / (4 pi R^3)
// in the plane, is that of 1 / R^3 + k^2 / (2 R), which are integrated exactly (the first as
// Hadamard's finite part). What a second sheet makes of the field of the first is the sound that
// both reflect, one after the other; the exact field is the sum of all such series.
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <ranges>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "formats/level/movable_part.h"
#include "runtime/occlusion/image_path.h"
#include "runtime/occlusion/mirror_plane.h"
#include "tests/box_mesh.h"
#include "tests/mirror_images.h"
#include "tests/physics/boundary_elements.h"

namespace clamor {
namespace {

using testing::Complex;
using testing::Element;
using testing::kPi;
using testing::kSound_mps;

// Hadamard's finite part of the integral of 1 / R^3 over an element, R from a point in its plane.
double integral_of_inverse_cube(const Element& e, double y, double z) {
  const auto primitive = [](double u, double v) { return -std::hypot(u, v) / (u * v); };
  const double u0 = e.y - y - e.width / 2, u1 = u0 + e.width;
  const double v0 = e.z - z - e.height / 2, v1 = v0 + e.height;
  return primitive(u1, v1) - primitive(u0, v1) - primitive(u1, v0) + primitive(u0, v0);
}

// A flat rectangle; its normal is u x v.
struct ScreenSheet {
  Vec3 middle_m, u, v;
  double width_m, height_m;

  Vec3 normal() const { return cross(u, v); }
  Vec3 at_m(double along_u_m, double along_v_m) const {
    return middle_m + along_u_m * u + along_v_m * v;
  }
  MirrorPlane plane() const { return {normal(), dot(normal(), middle_m)}; }
};

// The derivative of the incident pressure in a direction.
using Slope = std::function<Complex(const Vec3& at_m, const Vec3& direction)>;

Slope slope_of_source(const Vec3& from_m, double k) {
  return [=](const Vec3& at_m, const Vec3& direction) {
    const double r = length(at_m - from_m);
    return std::polar(1 / (r * r), k * r) * Complex(-1, k * r) * dot(at_m - from_m, direction) / r;
  };
}

// The sound that a sheet makes of an incident one.
class ScatteredSound {
 public:
  ScatteredSound(const ScreenSheet& sheet, double k, const Slope& incident)
      : sheet_(sheet),
        k_(k),
        elements_(testing::elements(sheet.width_m, sheet.height_m, 2 * kPi / k)) {
    const std::size_t n = elements_.size();
    std::vector<Complex> matrix(n * n), velocity(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Element& at = elements_[i];
      for (std::size_t j = 0; j < n; ++j) {
        const Element& from = elements_[j];
        const double r = std::hypot(at.y - from.y, at.z - from.z);
        const Complex rest =
            i == j ? Complex(0, k * k * k / 3)
                   : (std::polar(1.0, k * r) * Complex(1, -k * r) - 1.0 - k * k * r * r / 2) /
                         (r * r * r);
        matrix[i * n + j] = (integral_of_inverse_cube(from, at.y, at.z) +
                             k * k / 2 * testing::integral_of_inverse(from, at.y, at.z) +
                             rest * from.width * from.height) /
                            (4 * kPi);
      }
      velocity[i] = -incident(sheet.at_m(at.y, at.z), sheet.normal());
    }
    jumps_ = testing::solve(std::move(matrix), std::move(velocity));
  }

  Complex pressure(const Vec3& at_m) const {
    return sum_of(
        [&](const Vec3& out_m, double r) {
          return std::polar(1.0, k_ * r) * Complex(-1, k_ * r) * dot(out_m, sheet_.normal()) /
                 (r * r * r);
        },
        at_m);
  }

  Complex slope(const Vec3& at_m, const Vec3& direction) const {
    return sum_of(
        [&](const Vec3& out_m, double r) {
          const Complex ikr(0, k_ * r);
          const double across = dot(out_m, sheet_.normal()) * dot(out_m, direction) / (r * r);
          return std::polar(1.0, k_ * r) *
                 ((1.0 - ikr) * dot(sheet_.normal(), direction) -
                  (3.0 - 3.0 * ikr + ikr * ikr) * across) /
                 (r * r * r);
        },
        at_m);
  }

 private:
  // `kernel` takes the way from `at_m` to an element, and its length.
  template <class Kernel>
  Complex sum_of(const Kernel& kernel, const Vec3& at_m) const {
    Complex sum = 0;
    for (std::size_t i = 0; i < elements_.size(); ++i) {
      const Element& e = elements_[i];
      const Vec3 out_m = sheet_.at_m(e.y, e.z) - at_m;
      sum += jumps_[i] * e.width * e.height / (4 * kPi) * kernel(out_m, length(out_m));
    }
    return sum;
  }

  ScreenSheet sheet_;
  double k_;
  std::vector<Element> elements_;
  std::vector<Complex> jumps_;
};

Vec3 image_in_sheets(const std::vector<ScreenSheet>& sheets, Vec3 point_m) {
  for (const ScreenSheet& sheet : sheets) point_m = sheet.plane().image_of(point_m);
  return point_m;
}

// Power that sheets reflect one after the other, relative to the free field of the source's image,
// for each listener.
std::vector<double> exact_reflections(const std::vector<ScreenSheet>& sheets, double hz,
                                      const Vec3& from_m, const std::vector<Vec3>& listeners_m) {
  const double k = 2 * kPi * hz / kSound_mps;
  Slope incident = slope_of_source(from_m, k);
  for (const ScreenSheet& sheet : sheets | std::views::take(sheets.size() - 1))
    incident = [sound = ScatteredSound(sheet, k, incident)](const Vec3& at_m,
                                                            const Vec3& direction) {
      return sound.slope(at_m, direction);
    };
  const ScatteredSound last(sheets.back(), k, incident);
  std::vector<double> powers;
  for (const Vec3& to_m : listeners_m)
    powers.push_back(
        std::norm(last.pressure(to_m) * length(to_m - image_in_sheets(sheets, from_m))));
  return powers;
}

// The middle tone of a band.
double reflected_power(const OcclusionGeometry& geometry, const Source& image, const Vec3& to_m,
                       std::size_t band) {
  std::uint64_t rays = 0;
  const LineOfSight line{image.position_m, Vec3f(to_m), kSound_mps};
  return std::norm(image_sound(geometry, image, line, rays).pressure[3 * band + 1]);
}

Mesh plate(double size_m, double thickness_m) {
  Mesh box = box_mesh({thickness_m / 2, size_m / 2, size_m / 2}, 0);
  for (Vec3f& vertex_m : box.vertices_m) vertex_m.x -= static_cast<float>(thickness_m / 2);
  return box;
}

// A square sheet across the x axis.
ScreenSheet facing_x(double x_m, double y_m, double size_m) {
  return {{x_m, y_m, 0}, {0, 1, 0}, {0, 0, 1}, size_m, size_m};
}

Mesh mesh_of_sheets(const std::vector<ScreenSheet>& sheets) {
  Mesh mesh;
  for (const ScreenSheet& sheet : sheets) {
    const double u_m = sheet.width_m / 2, v_m = sheet.height_m / 2;
    testing::add_quad(mesh, {Vec3f(sheet.at_m(-u_m, -v_m)), Vec3f(sheet.at_m(u_m, -v_m)),
                             Vec3f(sheet.at_m(u_m, v_m)), Vec3f(sheet.at_m(-u_m, v_m))});
  }
  return mesh;
}

// The sound of one source that is reflected by sheets, one after the other.
struct PlateSeries {
  Vec3 from_m;
  std::vector<ScreenSheet> sheets;
  std::size_t bands;  // up from 63 Hz, as far as a few hundred elements suffice
  std::vector<Vec3> listeners_m;
};

// Before the first and after the last finite sheet, walls count as infinite.
std::vector<double> exact_reflections(PlateSeries of, double hz) {
  const auto is_wall = [](const ScreenSheet& sheet) { return sheet.width_m > 100; };
  for (; is_wall(of.sheets.front()); of.sheets.erase(of.sheets.begin()))
    of.from_m = of.sheets.front().plane().image_of(of.from_m);
  for (; is_wall(of.sheets.back()); of.sheets.pop_back())
    for (Vec3& to_m : of.listeners_m) to_m = of.sheets.back().plane().image_of(to_m);
  return exact_reflections(of.sheets, hz, of.from_m, of.listeners_m);
}

// Bounds for what is above -10 dB, and for what is above -20 dB.
void expect_exact_series(const PlateSeries& of, const Mesh& mesh, double within_db,
                         double quiet_within_db) {
  std::vector<MirrorPlane> planes;
  for (const ScreenSheet& sheet : of.sheets) planes.push_back(sheet.plane());
  const std::vector<Source> images = testing::images_by(planes, of.from_m);
  const OcclusionGeometry geometry(
      mesh, std::vector{testing::uniform_material(0, 0, kMirrorExponent)}, images);
  for (std::size_t b = 0; b < of.bands; ++b) {
    const double hz = 62.5 * std::exp2(static_cast<double>(b));
    const auto exact = exact_reflections(of, hz);
    for (std::size_t l = 0; l < exact.size(); ++l) {
      const double exact_db = 10 * std::log10(exact[l]);
      const double power_db =
          10 * std::log10(reflected_power(geometry, images.back(), of.listeners_m[l], b));
      if (exact_db < -20)
        EXPECT_LT(power_db, -15);
      else
        EXPECT_NEAR(power_db, exact_db, exact_db > -10 ? within_db : quiet_within_db)
            << hz << " Hz, listener " << l;
    }
  }
}

// On and off the direction of the mirror. At 63 Hz, 1 m2 reflects 25 dB less than a wall.
TEST(Plates, ReflectAsTheExactSolution) {
  struct Case {
    double size_m, thickness_m;
    std::size_t bands;
  };
  for (const Case& plate_of : {Case{1, 0, 4}, Case{1, 0.05, 3}, Case{3, 0, 2}}) {
    const ScreenSheet sheet = facing_x(0, 0, plate_of.size_m);
    for (const double from_deg : {0.0, 30.0}) {
      SCOPED_TRACE(::testing::Message() << plate_of.size_m << " m, " << plate_of.thickness_m
                                        << " m thick, from " << from_deg << " degrees");
      const double from_rad = from_deg * kPi / 180;
      PlateSeries of{
          {3 * std::cos(from_rad), -3 * std::sin(from_rad), 0}, {sheet}, plate_of.bands, {}};
      for (const double deg : {0.0, 15.0, 30.0, 45.0, 60.0, 75.0})
        of.listeners_m.emplace_back(2 * std::cos(deg * kPi / 180), 2 * std::sin(deg * kPi / 180),
                                    0.1);
      expect_exact_series(of,
                          plate_of.thickness_m > 0 ? plate(plate_of.size_m, plate_of.thickness_m)
                                                   : mesh_of_sheets({sheet}),
                          1.5, 3.5);
    }
  }
}

const Vec3 kPlateSource_m(1.5, -1.5, 0);

std::vector<Vec3> listeners_at(double x, const std::vector<double>& ys) {
  std::vector<Vec3> made;
  for (const double y : ys) made.emplace_back(x, y, 0.2);
  return made;
}

// With one plate among walls, the error is that of the plate alone. Of two, the second is as the
// first's image would see it, although borders send their sound to it as well: that is lost.
TEST(Plates, ReflectOneAfterTheOtherAsTheExactSolution) {
  const ScreenSheet wall = facing_x(0, 0, 400), opposite = facing_x(3, 0, 400);
  const ScreenSheet floor{Vec3(0), {0, 0, 1}, {1, 0, 0}, 400, 400};
  const ScreenSheet front{{9, 1.5, 0}, {0, 0, 1}, {0, 1, 0}, 4, 1};
  const std::vector<Vec3> across = listeners_at(1, {-1, 0.5, 1.5, 2.5, 3.5, 4.5, 6}),
                          beside = listeners_at(1, {0.5, 1.5, 2.5, 3.5, 4.5, 6}),
                          behind = listeners_at(1.5, {-1, 1, 2.5, 3.5, 4.5, 5.5, 7}),
                          before_front{{7, 1, 1},   {6, 1.2, 1}, {4, 1.2, 1},
                                       {6, 2.5, 1}, {6, 4, 1},   {6, 1.2, 3}};
  struct Case {
    PlateSeries of;
    double within_db, quiet_within_db;
  };
  const Case cases[] = {
      {{kPlateSource_m, {facing_x(0, 0, 2), opposite}, 4, across}, 1.5, 1.5},
      {{kPlateSource_m, {wall, facing_x(3, 1.5, 2)}, 4, across}, 1, 2.5},
      {{kPlateSource_m, {wall, facing_x(3, 1.2, 2), wall}, 4, behind}, 1, 2.5},
      {{{2, 1.2, 0}, {floor, front}, 4, before_front}, 1.7, 3.2},
      {{kPlateSource_m, {facing_x(0, -0.3, 1), facing_x(3, 1.5, 1)}, 3, across}, 0, 3.6},
      {{kPlateSource_m, {facing_x(0, -0.3, 2), facing_x(3, 1.5, 2)}, 3, beside}, 4.6, 6}};
  for (const Case& one : cases) {
    SCOPED_TRACE(::testing::Message() << "case " << &one - cases);
    std::vector<ScreenSheet> once = one.of.sheets;
    if (once.size() == 3) once.pop_back();
    expect_exact_series(one.of, mesh_of_sheets(once), one.within_db, one.quiet_within_db);
  }
}

// The tests of several plates rest on their exact solution. That of two plates is the same from the
// listener to the source, within 0.1 dB.
TEST(Plates, HaveAReciprocalExactSolution) {
  for (const double size_m : {1.0, 2.0}) {
    const PlateSeries of{kPlateSource_m,
                         {facing_x(0, -0.3, size_m), facing_x(3, 1.5, size_m)},
                         0,
                         listeners_at(1, {1.5})};
    const PlateSeries reverse{of.listeners_m[0], {of.sheets[1], of.sheets[0]}, 0, {of.from_m}};
    EXPECT_NEAR(exact_reflections(reverse, 125)[0] / exact_reflections(of, 125)[0], 1, 0.023);
  }
}

}  // namespace
}  // namespace clamor
