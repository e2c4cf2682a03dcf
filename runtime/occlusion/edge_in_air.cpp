#include "runtime/occlusion/edge_in_air.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace clamor {

namespace {

using std::numbers::pi;

// Rays pass the edge at this distance in the air, and go on as far, so that a surface that touches
// the edge blocks them.
constexpr double kOffset_m = 0.005;
constexpr double kInset_m = 0.01;  // from the ends of the edge
// An edge that ends at a surface at about a right angle goes on as its image in it.
constexpr double kMirrorReach_m = 0.02, kMirrorCosine = 0.95;
// A wall end is a sheet where it is narrower than the first fraction of the wave, two corners where
// it is wider than the second.
constexpr double kNarrow = 0.5, kBroad = 2;

}  // namespace

double wave_number(std::size_t tone, double speed_of_sound_mps) {
  const double octave = (static_cast<double>(tone) - 1) / static_cast<double>(kTonesPerBand);
  return 2 * pi * 62.5 * std::exp2(octave) / speed_of_sound_mps;
}

EdgeInAir::EdgeInAir(const OcclusionGeometry& geometry, const DiffractingEdge& edge,
                     double speed_of_sound_mps, std::uint64_t& rays)
    : geometry_(geometry),
      edge_(edge),
      start_m_(edge.from_m),
      length_m_(length(Vec3(edge.to_m) - Vec3(edge.from_m))),
      speed_of_sound_mps_(speed_of_sound_mps),
      rays_(rays) {
  const double half_air = 0.5 * static_cast<double>(edge.air_rad);
  start_m_ +=
      kOffset_m * (std::cos(half_air) * Vec3(edge.face) + std::sin(half_air) * Vec3(edge.air));
  if (edge.is_sheet)
    aside_m_ = (0.5 * static_cast<double>(edge.width_m) + kOffset_m) * Vec3(edge.air);
  before_m_ = edge.goes_on_before && is_mirrored(0, -1) ? length_m_ : 0;
  beyond_m_ = edge.goes_on_beyond && is_mirrored(length_m_, 1) ? length_m_ : 0;
}

double EdgeInAir::weight(double z) const {
  // The end of an edge without an image has its whole weight, though rounding places it beyond.
  const double image_m = z < 0 ? before_m_ : beyond_m_;
  if (!(image_m > 0)) return 1;
  const double u = std::max({-z, z - length_m_, 0.0}) / image_m;
  return 0.5 + 0.5 * std::cos(pi * std::min(u, 1.0));
}

Vec3 EdgeInAir::place_m(double z) const {
  if (z < 0) z = -z;
  if (z > length_m_) z = 2 * length_m_ - z;
  const double inset_m = std::min(kInset_m, 0.1 * length_m_);
  return start_m_ + std::clamp(z, inset_m, length_m_ - inset_m) * Vec3(edge_.along);
}

double EdgeInAir::share(std::size_t tone) const {
  const double waves = static_cast<double>(edge_.width_m) * wave_number(tone) / (2 * pi);
  const double corners =
      std::clamp(std::log2(waves / kNarrow) / std::log2(kBroad / kNarrow), 0.0, 1.0);
  return edge_.is_sheet ? 1 - corners : corners;
}

// Over a sheet, sound passes one corner and then the other.
std::optional<MirrorPath> EdgeInAir::path_from(const PathEnd& end, double z) const {
  Vec3 point = place_m(z);
  if (edge_.is_sheet) point += (dot(end.seen_m - point, aside_m_) < 0 ? -1.0 : 1.0) * aside_m_;
  return mirror_path(geometry_, point + kOffset_m * normalize(point - end.seen_m), end, rays_);
}

bool EdgeInAir::is_open(double z) const {
  if (!edge_.is_sheet) return true;
  ++rays_;
  const Vec3 point = place_m(z);
  return geometry_.is_free(Vec3f(point - aside_m_), Vec3f(point + aside_m_));
}

bool EdgeInAir::sees(double z, const EdgeInAir& other, double other_z) const {
  ++rays_;
  return geometry_.is_free(Vec3f(place_m(z)), Vec3f(other.place_m(other_z)));
}

// Returns whether a surface crosses the end of the edge, on both sides of a sheet.
bool EdgeInAir::is_mirrored(double z, double direction) const {
  const Vec3 reach_m = direction * kMirrorReach_m * Vec3(edge_.along);
  const Vec3 back_m = -std::min(1.0, 0.2 * length_m_ / kMirrorReach_m) * reach_m;
  const auto is_crossed = [&](const Vec3& end_m) {
    ++rays_;
    const auto surface = geometry_.first_surface(Vec3f(end_m + back_m), Vec3f(end_m + reach_m));
    return surface && std::abs(dot(Vec3(surface->normal), Vec3(edge_.along))) > kMirrorCosine;
  };
  const Vec3 end_m = start_m_ + z * Vec3(edge_.along);
  return is_crossed(end_m + aside_m_) && (!edge_.is_sheet || is_crossed(end_m - aside_m_));
}

}  // namespace clamor
