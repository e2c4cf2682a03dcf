#include "runtime/occlusion/fresnel_zone.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace clamor {

namespace {

constexpr int kMaxReflections = 6;    // a path with more is lost
constexpr double kInnerWeight = 0.7;  // of D(l) in S
// Sine of the angle above a wall at which the listener sees paths that no longer pass it.
constexpr double kGrazingSine = 0.5;
// Fitted to the half-plane.
constexpr float kLongDetourWeight = 0.36f;
constexpr double kGoldenRatio = 0.6180339887498949;

// A path bends at these fractions of the straight line from either end. The offset there is a fifth
// more than the ellipse's, because the chords run inside the ellipse.
constexpr double kBendFraction = 0.03, kBendOffset = 1.2;

// Halton's low-discrepancy sequence.
double radical_inverse(std::uint32_t base, std::uint32_t i) {
  double value = 0, digit = 1;
  for (; i > 0; i /= base) {
    digit /= base;
    value += digit * (i % base);
  }
  return value;
}

// The sample pattern, which all lines share.
struct PathPattern {
  std::vector<PathAzimuth> azimuths;                // ring after ring
  std::array<double, kFinePaths> area_fractions{};  // of the ring's area, within the path
  std::array<double, kFinePaths> chances{};
};

const PathPattern& path_pattern() {
  static const PathPattern kPattern = [] {
    PathPattern made;
    for (std::size_t r = 0; r < kZoneRings; ++r)
      for (std::uint32_t i = 0; i < kFinePaths; ++i)
        made.azimuths.emplace_back(2 * std::numbers::pi *
                                   (radical_inverse(2, i) + kGoldenRatio * static_cast<double>(r)));
    for (std::uint32_t i = 0; i < kFinePaths; ++i)
      made.area_fractions[i] = radical_inverse(3, i + 1);
    for (std::uint32_t i = 0; i < kFinePaths; ++i) made.chances[i] = radical_inverse(5, i + 1);
    return made;
  }();
  return kPattern;
}

}  // namespace

const PathAzimuth& path_azimuth(std::size_t ring, int i) {
  return path_pattern().azimuths[ring * kFinePaths + static_cast<std::size_t>(i)];
}

double path_chance(int i) { return path_pattern().chances[static_cast<std::size_t>(i)]; }

PathFrame::PathFrame(const LineOfSight& of)
    : line(of),
      along_m(Vec3(of.to_m) - Vec3(of.from_m)),
      length_m(length(along_m)),
      basis{Vec3(0), Vec3(0)} {
  if (length_m > 0) basis = basis_around(along_m / length_m);
}

DetourPath::DetourPath(const PathFrame& frame, double detour_m, const PathAzimuth& azimuth,
                       double of_chance)
    : chance(of_chance) {
  const Vec3 from(frame.line.from_m);
  const double length_m = frame.length_m;
  const Vec3 aside = azimuth.cos * frame.basis.tangent + azimuth.sin * frame.basis.bitangent;
  // The minor half axis of the ellipse of paths with this detour, and the offset at the bends.
  const double middle_m = std::sqrt(detour_m * (2 * length_m + detour_m)) / 2;
  const double eccentric = (1 - 2 * kBendFraction) * length_m / (length_m + detour_m);
  const double bend_m =
      middle_m * std::min(1.0, kBendOffset * std::sqrt(1 - eccentric * eccentric));
  points_m = {frame.line.from_m, Vec3f(from + kBendFraction * frame.along_m + bend_m * aside),
              Vec3f(from + 0.5 * frame.along_m + middle_m * aside),
              Vec3f(from + (1 - kBendFraction) * frame.along_m + bend_m * aside), frame.line.to_m};
}

PathHit DetourPath::hit(const OccluderPlane& wall, std::size_t segment, const LineOfSight& line) {
  const bool in_front = wall.height_m(line.from_m) > 0;
  if (in_front != (wall.height_m(line.to_m) > 0) && !is_passed(wall, segment, line))
    return PathHit::kBlocked;
  if (reflections++ == kMaxReflections) return PathHit::kLost;
  if (in_front != (wall.height_m(line.to_m) > 0) && segment == kSegments) {
    points_m[segment - 1] = line.to_m - 2 * wall.height_m(line.to_m) * wall.normal;
    return PathHit::kReflected;
  }
  bool reflected = false;
  for (std::size_t j = segment; j < kSegments; ++j) {
    const float height_m = wall.height_m(points_m[j]);
    if ((height_m > 0) == in_front) continue;
    points_m[j] -= 2 * height_m * wall.normal;
    reflected = reflected || j == segment;
  }
  return reflected ? PathHit::kReflected : PathHit::kLost;
}

// A listener who steps through an opening in a wall crosses its plane, where the wall begins to
// part the listener from the source. A path that meets the wall at a grazing angle, as seen by the
// listener, is still reflected there as before. It has to pass the opening where the listener is,
// so that nothing is heard through the wall itself.
bool DetourPath::is_passed(const OccluderPlane& wall, std::size_t segment,
                           const LineOfSight& line) const {
  const Vec3f &a = points_m[segment - 1], &b = points_m[segment];
  const float before_m = wall.height_m(a), behind_m = wall.height_m(b);
  if (before_m == behind_m) return false;
  const Vec3f point_m = a + before_m / (before_m - behind_m) * (b - a);
  const float distance_m = glm::length(point_m - line.to_m);
  const float sine = distance_m > 0 ? std::abs(wall.height_m(line.to_m)) / distance_m : 1;
  return chance < 1 - static_cast<double>(sine) / kGrazingSine;
}

FresnelZone::FresnelZone(const PathFrame& frame) : length_m(frame.length_m) {
  const double longest_m = 2 * wavelength_m(0, frame.line.speed_of_sound_mps);
  for (std::size_t r = 0; r < kZoneRings; ++r) {
    const double detour_m = std::ldexp(longest_m, -static_cast<int>(r));
    area_m2_[r] = detour_m * (2 * length_m + detour_m);
  }
}

double FresnelZone::detour_m(std::size_t ring, int i) const {
  const double outer_m2 = area_m2_[ring], inner_m2 = area_m2_[ring + 1];
  const double area_m2 =
      inner_m2 + (outer_m2 - inner_m2) * path_pattern().area_fractions[static_cast<std::size_t>(i)];
  return std::sqrt(length_m * length_m + area_m2) - length_m;
}

// Returns whether both rings have free paths only, or blocked paths only.
bool FresnelZone::agree(std::size_t a, std::size_t b) const {
  return !rings[a].mixed() && !rings[b].mixed() &&
         (rings[a].counted == 0 || rings[b].counted == 0 ||
          (rings[a].free > 0) == (rings[b].free > 0));
}

bool FresnelZone::is_settled(std::size_t ring) const {
  return (ring == 0 || agree(ring, ring - 1)) && (ring + 1 == kZoneRings || agree(ring, ring + 1));
}

// Unoccluded fraction of each ring with all rings within it. A ring without a known path takes the
// fraction of the rings within.
std::array<float, kZoneRings> FresnelZone::disc_fractions() const {
  std::array<float, kZoneRings> discs{};
  discs[kZoneRings - 1] = rings[kZoneRings - 1].free_fraction();
  for (std::size_t r = kZoneRings - 1; r-- > 0;) {
    const auto within = static_cast<float>(area_m2_[r + 1] / area_m2_[r]);
    discs[r] = rings[r].counted > 0
                   ? within * discs[r + 1] + (1 - within) * rings[r].free_fraction()
                   : discs[r + 1];
  }
  return discs;
}

Bands FresnelZone::visibility() const {
  const auto free = disc_fractions();
  // One edge beside a free line leaves half of a zone free at least. If less is free around a line
  // that has no edge near by, it passes an opening, which lets pass what falls on it.
  const float is_apart = std::max(2 * free.back() - 1, 0.0f);
  Bands visibility{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const auto inner = static_cast<float>(kInnerWeight);
    const float share = inner * free[b + 1] + (1 - inner) * free[b];
    const float a = std::max(diffracted_amplitude(share), amplitude_of_long_detours(b));
    visibility[b] = a * a;
    if (share >= 0.5f) continue;
    const float of_opening = diffracted_amplitude(1 - share);
    visibility[b] += is_apart * (of_opening * of_opening - visibility[b]);
  }
  return visibility;
}

// In a shadow, amplitudes fall as the inverse square root of the detour in wavelengths.
float FresnelZone::amplitude_of_long_detours(std::size_t band) const {
  float power = 0, weight = kLongDetourWeight * kLongDetourWeight;
  for (std::size_t r = band + 1; r-- > 0; weight /= 2)
    power += weight * rings[r].free_fraction() * rings[r].free_fraction();
  return std::sqrt(power);
}

}  // namespace clamor
