#include "runtime/occlusion/seat_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/material.h"
#include "formats/bake_file/image_source.h"
#include "runtime/occlusion/edge_diffraction.h"
#include "runtime/occlusion/mirror_plane.h"

namespace clamor {

namespace {

using Complex = std::complex<double>;
using std::numbers::inv_sqrtpi;
using std::numbers::pi;

constexpr double kFar_m = 4;
constexpr double kReach_m = 0.05;  // of a ray beyond the plane
constexpr double kSamePlane_m = 0.02, kSameCosine = 0.99;
// The reflection fades where its place is this near to the border of the rows.
constexpr double kBorder_m = 1;
constexpr int kPoints = 5;  // across it

// exp(-z^2) erfc(-i z), within 1e-11. (J. A. C. Weideman. Computation of the Complex Error
// Function. SIAM J. Numer. Anal. 31(5), 1994.)
class Faddeeva {
 public:
  Faddeeva() {
    std::array<double, 2 * kHalf> values{};
    for (int i = 1; i < 2 * kHalf; ++i) {
      const double t = scale_ * std::tan((i - kHalf) * pi / (2 * kHalf));
      values[static_cast<std::size_t>(i)] = std::exp(-t * t) * (scale_ * scale_ + t * t);
    }
    for (int m = 1; m <= kTerms; ++m) {
      double sum = 0;
      for (int i = 0; i < 2 * kHalf; ++i)
        sum += values[static_cast<std::size_t>(i)] * std::cos(pi * m * (i - kHalf) / kHalf);
      terms_[static_cast<std::size_t>(m - 1)] = sum / (2 * kHalf);
    }
  }

  Complex operator()(const Complex& z) const {
    if (z.imag() < 0) return 2.0 * std::exp(-z * z) - (*this)(-z);
    const Complex up(0, 1), below = scale_ - up * z, ratio = (scale_ + up * z) / below;
    Complex sum = 0;
    for (std::size_t m = kTerms; m-- > 0;) sum = sum * ratio + terms_[m];
    return 2.0 * sum / (below * below) + inv_sqrtpi / below;
  }

 private:
  static constexpr int kTerms = 32, kHalf = 2 * kTerms;
  double scale_ = std::sqrt(kTerms / std::numbers::sqrt2);
  std::array<double, kTerms> terms_{};
};

// Rows below a place.
struct RowsBelow {
  const Material* material;
  MirrorPlane tops;
  double share;  // less than 1 far above them
};

std::optional<RowsBelow> rows_below(const OcclusionGeometry& geometry, const Vec3& place_m,
                                    std::uint64_t& rays) {
  ++rays;
  const auto hit = geometry.first_level_hit(Vec3f(place_m), Vec3f(place_m - Vec3(0, kFar_m, 0)));
  const Material* const material = hit ? geometry.rows(hit->material) : nullptr;
  if (material == nullptr) return std::nullopt;
  RowsBelow below{material, {}, 0};
  below.tops.normal = hit->normal.y < 0 ? -Vec3(hit->normal) : Vec3(hit->normal);
  const double above_m = kFar_m * static_cast<double>(hit->fraction);
  below.tops.offset_m = dot(below.tops.normal, place_m - Vec3(0, above_m, 0));
  below.share = std::min(1.0, 2 - 2 * above_m / kFar_m);
  return below;
}

// Whether the first surface on the way is of rows that lie like these.
bool meets_rows(const OcclusionGeometry& geometry, const RowsBelow& below, const Vec3& place_m,
                const Vec3& to_m, std::uint64_t& rays) {
  ++rays;
  const auto hit = geometry.first_level_hit(Vec3f(place_m), Vec3f(to_m));
  return hit && geometry.rows(hit->material) != nullptr &&
         std::abs(dot(Vec3(hit->normal), below.tops.normal)) > kSameCosine;
}

// The share of points round the reflection's place that are on such rows.
double share_of_rows(const OcclusionGeometry& geometry, const RowsBelow& below, const Vec3& place_m,
                     const Vec3& point_m, std::uint64_t& rays) {
  Vec3 along = point_m - place_m;
  along -= dot(along, below.tops.normal) * below.tops.normal;
  if (dot(along, along) > 0) along = normalize(along);
  int on = 0;
  for (int i = 0; i < kPoints; ++i) {
    const Vec3 to_m = point_m + along * (kBorder_m * (2.0 * i / (kPoints - 1) - 1));
    on += meets_rows(geometry, below, place_m, to_m + kReach_m * normalize(to_m - place_m), rays);
  }
  return on / static_cast<double>(kPoints);
}

// The pressure by way of the rows, relative to the straight one.
std::optional<EdgeSound> sound_over(const OcclusionGeometry& geometry, const RowsBelow& below,
                                    const PathEnd& from, const Vec3& place_m,
                                    double speed_of_sound_mps, std::uint64_t& rays) {
  const double above_m = below.tops.height_m(place_m), beyond_m = below.tops.height_m(from.seen_m);
  if (!(above_m > 0 && beyond_m > 0)) return std::nullopt;
  const Vec3 path_m = below.tops.image_of(from.seen_m) - place_m;
  const Vec3 point_m = place_m + path_m * (above_m / (above_m + beyond_m));
  const double share = below.share * share_of_rows(geometry, below, place_m, point_m, rays);
  if (!(share > 0) ||
      !mirror_path(geometry, point_m + below.tops.normal * OcclusionGeometry::kStartOffset_m, from,
                   rays))
    return std::nullopt;
  EdgeSound sound;
  sound.is_heard = true;
  sound.path_m = length(path_m);
  const double straight_m = length(from.seen_m - place_m);
  for (std::size_t i = 0; i < kTones; ++i) {
    const std::size_t band = i / kTonesPerBand;
    const double k = wave_number(i, speed_of_sound_mps),
                 scattered = static_cast<double>(below.material->scattering[band]);
    sound.pressure[i] = share * std::sqrt(1 - scattered) * straight_m / sound.path_m *
                        reflection_of_rows(*below.material, band, k,
                                           (above_m + beyond_m) / sound.path_m, sound.path_m) *
                        std::polar(1.0, k * (sound.path_m - straight_m));
  }
  return sound;
}

bool are_one(const RowsBelow& a, const RowsBelow& b, const Vec3& place_m) {
  return dot(a.tops.normal, b.tops.normal) > kSameCosine &&
         std::abs(a.tops.height_m(place_m) - b.tops.height_m(place_m)) < kSamePlane_m;
}

}  // namespace

Complex reflection_of_rows(const Material& material, std::size_t band, double wave_number,
                           double cos_i, double path_m) {
  static const Faddeeva kFaddeeva;
  const Complex echo = std::polar(std::sqrt(1 - static_cast<double>(material.absorption[band])),
                                  2 * wave_number * static_cast<double>(material.rows_m));
  // R = (c - beta) / (c + beta), with both multiplied by 1 + e, which may be near 0.
  const Complex sum = cos_i * (1.0 + echo) + (1.0 - echo);
  const Complex plane = (cos_i * (1.0 + echo) - (1.0 - echo)) / sum;
  const Complex w = std::polar(std::sqrt(wave_number * path_m / 2), pi / 4) * sum / (1.0 + echo);
  // For large w, F(w) is -1 / 2 w^2.
  if (!(std::abs(w) < 1e3)) return plane;
  const Complex boundary = 1.0 + Complex(0, 1 / inv_sqrtpi) * w * kFaddeeva(w);
  return plane + (1.0 - plane) * boundary;
}

Bands power_over_rows(const OcclusionGeometry& geometry, const PathEnd& from, const Vec3& place_m,
                      double speed_of_sound_mps, std::uint64_t& rays) {
  const double straight_m = length(from.seen_m - place_m);
  Bands power = same_in_all_bands(1);
  if (!(straight_m > 0)) return power;
  auto at_place = rows_below(geometry, place_m, rays);
  auto at_source = rows_below(geometry, from.real_m, rays);
  if (at_place && at_source && are_one(*at_place, *at_source, from.real_m)) {
    at_place->share = std::max(at_place->share, at_source->share);
    at_source.reset();
  }
  if (from.is_image()) {
    // The share of the image that is the rows' own mirror image, and that they replace.
    const double ours = std::max(
        at_place && meets_rows(geometry, *at_place, place_m, from.seen_m, rays) ? at_place->share
                                                                                : 0.0,
        at_source && length(at_source->tops.image_of(from.real_m) - from.seen_m) <=
                         image_tolerance_m(straight_m)
            ? at_source->share
            : 0.0);
    if (ours > 0) return same_in_all_bands(static_cast<float>(1 - ours));
  }
  std::array<std::optional<EdgeSound>, 2> sounds;
  if (at_place)
    sounds[0] = sound_over(geometry, *at_place, from, place_m, speed_of_sound_mps, rays);
  if (at_source && !from.is_image())
    sounds[1] = sound_over(geometry, *at_source, place_m, from.real_m, speed_of_sound_mps, rays);
  Tones straight;
  straight.fill(1);
  for (const auto& sound : sounds) {
    if (!sound) continue;
    const Bands factor = power_of(straight, straight_m, {&*sound, 1}, speed_of_sound_mps);
    for (std::size_t b = 0; b < kBandCount; ++b) power[b] *= factor[b];
  }
  return power;
}

}  // namespace clamor
