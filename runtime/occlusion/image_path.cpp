#include "runtime/occlusion/image_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "runtime/occlusion/diffraction_paths.h"
#include "runtime/occlusion/mirror_edges.h"
#include "runtime/occlusion/mirror_path.h"

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

// The share of the amplitude that arrives around the listener, and by the straight path itself.
struct Unfolded {
  Bands mean{}, straight{};
  bool is_straight = false;
  int order = 0;  // of the straight path

  Bands blended(double straight_share) const {
    Bands amplitude{};
    for (std::size_t b = 0; b < kBandCount; ++b)
      amplitude[b] = mean[b] + static_cast<float>(straight_share) * (straight[b] - mean[b]);
    return amplitude;
  }
};

Unfolded look_from_disc(const OcclusionGeometry& geometry, const PathEnd& image, const Vec3& place,
                        std::uint64_t& rays) {
  const Basis basis = basis_around(normalize(image.seen_m - place));
  Unfolded seen;
  Bands amplitude{};
  int counted = 0, heard = 0;
  const auto look_from = [&](const Vec3& point_m) {
    const auto path = mirror_path(geometry, point_m, image, rays);
    ++counted;
    if (!path) return;
    for (std::size_t b = 0; b < kBandCount; ++b) amplitude[b] += std::sqrt(path->reflected[b]);
    ++heard;
    if (counted > 1) return;
    seen.is_straight = true;
    seen.order = path->order;
    seen.straight = amplitude;
  };
  look_from(place);
  for (int i = 0; i < kRimPoints + kInnerPoints; ++i) {
    if (i == kRimPoints && (heard == 0 || heard == counted)) break;
    const auto [u, v] = disc_point(i);
    const Vec3 point_m = place + (basis.tangent * u + basis.bitangent * v) * kDiscRadius_m;
    ++rays;
    if (geometry.is_free(Vec3f(place), Vec3f(point_m))) look_from(point_m);
  }
  for (std::size_t b = 0; b < kBandCount; ++b)
    seen.mean[b] = amplitude[b] / static_cast<float>(counted);
  return seen;
}

}  // namespace

DirectSound image_sound(const OcclusionGeometry& geometry, const Source& image,
                        const LineOfSight& line, std::uint64_t& rays) {
  DirectSound sound;
  const Vec3 place(line.to_m);
  const PathEnd end(Vec3(line.from_m), Vec3(image.original_m), image.is_in_part);
  if (!end.is_image() || end.seen_m == place) return sound;
  const Unfolded seen = look_from_disc(geometry, end, place, rays);
  MirrorEdges edges;
  if (seen.order <= 1)
    edges = sound_over_mirror_edges(geometry, end, place, !seen.is_straight,
                                    line.speed_of_sound_mps, rays);
  const Bands amplitude = seen.blended(edges.nearness);
  sound.pressure = edges.across;
  for (std::size_t i = 0; i < kTones; ++i)
    sound.pressure[i] += static_cast<double>(amplitude[i / kTonesPerBand]);
  sound.visibility =
      power_of(sound.pressure, length(end.seen_m - place), edges.sounds, line.speed_of_sound_mps);
  for (const EdgeSound& one : edges.sounds)
    for (std::size_t i = 0; i < kTones; ++i) sound.pressure[i] += one.pressure[i];
  sound.is_over_edges = !edges.sounds.empty();
  if (sound.is_over_edges && !seen.is_straight) sound.bent = mean_path(line, edges.sounds);
  return sound;
}

}  // namespace clamor
