#include "runtime/occlusion/image_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "formats/bake_file/image_source.h"

namespace clamor {

namespace {

constexpr int kRimPoints = 6, kInnerPoints = 12;

// Points of the disc, as parts of its radius: a hexagon on its rim, and others spread inside it.
std::array<double, 2> disc_point(int i) {
  if (i < kRimPoints) {
    const double turn = 2 * std::numbers::pi * i / kRimPoints;
    return {std::cos(turn), std::sin(turn)};
  }
  const int inner = i - kRimPoints;
  const double radius = std::cos(std::numbers::pi / kRimPoints) *
                        std::sqrt((inner + 0.5) / static_cast<double>(kInnerPoints));
  const double turn = 2 * std::numbers::pi * std::numbers::phi * inner;
  return {radius * std::cos(turn), radius * std::sin(turn)};
}

// The share that arrives at one point; all zero if no path leads there.
Bands along_path(const OcclusionGeometry& geometry, const Source& image, const Vec3& place,
                 std::uint64_t& rays) {
  const Vec3 source_m(image.mirror);
  Vec3 from_m = place, target_m(image.position_m);
  const double within_m = image_tolerance_m(length(target_m - place));
  Bands share = same_in_all_bands(1);
  for (int reflections = 0;; ++reflections) {
    if (reflections > 0 && length(target_m - source_m) <= within_m) {
      ++rays;
      return geometry.is_free(Vec3f(from_m), Vec3f(source_m)) ? share : Bands{};
    }
    if (reflections == kMaxImageOrder) return Bands{};
    ++rays;
    const auto hit = geometry.first_level_hit(Vec3f(from_m), Vec3f(target_m));
    if (!hit) return Bands{};
    const Bands& mirrored = geometry.mirror_reflection(hit->material);
    float most = 0;
    for (std::size_t b = 0; b < kBandCount; ++b) most = std::max(most, share[b] *= mirrored[b]);
    if (!(most > 0)) return Bands{};
    const Vec3 point_m = from_m + (target_m - from_m) * static_cast<double>(hit->fraction);
    Vec3 normal(hit->normal);
    if (dot(from_m - point_m, normal) < 0) normal = -normal;
    target_m += normal * (2 * dot(point_m - target_m, normal));
    from_m = point_m + normal * OcclusionGeometry::kStartOffset_m;
  }
}

}  // namespace

Bands image_visibility(const OcclusionGeometry& geometry, const Source& image, const Vec3& place,
                       std::uint64_t& rays) {
  const Vec3 away_m = Vec3(image.position_m) - place;
  if (!(length(away_m) > 0)) return Bands{};
  const Basis basis = basis_around(normalize(away_m));
  Bands amplitude{};
  int counted = 0, heard = 0;
  const auto look_from = [&](const Vec3& point_m) {
    const Bands share = along_path(geometry, image, point_m, rays);
    ++counted;
    heard += share == Bands{} ? 0 : 1;
    for (std::size_t b = 0; b < kBandCount; ++b) amplitude[b] += std::sqrt(share[b]);
  };
  look_from(place);
  for (int i = 0; i < kRimPoints + kInnerPoints; ++i) {
    if (i == kRimPoints && (heard == 0 || heard == counted)) break;
    const auto [u, v] = disc_point(i);
    const Vec3 point_m = place + (basis.tangent * u + basis.bitangent * v) * kDiscRadius_m;
    ++rays;
    if (geometry.is_free(Vec3f(place), Vec3f(point_m))) look_from(point_m);
  }
  if (heard == 0) return Bands{};
  Bands visibility{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const float mean = amplitude[b] / static_cast<float>(counted);
    visibility[b] = mean * mean;
  }
  return visibility;
}

}  // namespace clamor
