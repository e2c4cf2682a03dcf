#include "runtime/occlusion/fresnel_zone.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace clamor {

namespace {

constexpr int kMostFolds = 6;
constexpr double kInnerWeight = 0.7;
constexpr double kGolden = 0.6180339887498949;

// Where between source and listener a way bends, and how far out compared with half way: a fifth
// more than the ellipse there, as its chords run inside it.
constexpr double kBend = 0.03, kWider = 1.2;

// Halton's points.
double radical_inverse(std::uint32_t base, std::uint32_t i) {
  double value = 0, digit = 1;
  for (; i > 0; i /= base) {
    digit /= base;
    value += digit * (i % base);
  }
  return value;
}

// Of the ways of a look, the same for every line: they are worked out once.
struct Places {
  std::vector<PathAzimuth> turns;           // of the ways of a ring, ring after ring
  std::array<double, kFinePaths> across{};  // share of the ring's area that is within
};

const Places& places() {
  static const Places kPlaces = [] {
    Places made;
    for (std::size_t r = 0; r < kZoneRings; ++r)
      for (std::uint32_t i = 0; i < kFinePaths; ++i)
        made.turns.emplace_back(2 * std::numbers::pi *
                                (radical_inverse(2, i) + kGolden * static_cast<double>(r)));
    for (std::uint32_t i = 0; i < kFinePaths; ++i) made.across[i] = radical_inverse(3, i + 1);
    return made;
  }();
  return kPlaces;
}

}  // namespace

const PathAzimuth& path_azimuth(std::size_t ring, int i) {
  return places().turns[ring * kFinePaths + static_cast<std::size_t>(i)];
}

PathFrame::PathFrame(const LineOfSight& of)
    : line(of), way(Vec3(of.to_m) - Vec3(of.from_m)), way_m(length(way)), basis{Vec3(0), Vec3(0)} {
  if (way_m > 0) basis = basis_around(way / way_m);
}

Way::Way(const PathFrame& frame, double detour_m, const PathAzimuth& turn) {
  const Vec3 from(frame.line.from_m);
  const double way_m = frame.way_m;
  const Vec3 aside = turn.cos * frame.basis.tangent + turn.sin * frame.basis.bitangent;
  // Half the short axis of the ellipse of such ways, and the ellipse's width at the bends.
  const double out_m = std::sqrt(detour_m * (2 * way_m + detour_m)) / 2;
  const double slim = (1 - 2 * kBend) * way_m / (way_m + detour_m);
  const double bend_m = out_m * std::min(1.0, kWider * std::sqrt(1 - slim * slim));
  at = {frame.line.from_m, Vec3f(from + kBend * frame.way + bend_m * aside),
        Vec3f(from + 0.5 * frame.way + out_m * aside),
        Vec3f(from + (1 - kBend) * frame.way + bend_m * aside), frame.line.to_m};
}

Way::Met Way::meet(const OccluderPlane& wall, std::size_t piece, const LineOfSight& line) {
  const bool before = wall.height_m(line.from_m) > 0;
  if (before != (wall.height_m(line.to_m) > 0)) return Met::kBlocked;
  if (folds++ == kMostFolds) return Met::kLost;
  bool folded = false;
  for (std::size_t j = piece; j < kPieces; ++j) {
    const float height_m = wall.height_m(at[j]);
    if ((height_m > 0) == before) continue;
    at[j] -= 2 * height_m * wall.normal;
    folded = folded || j == piece;
  }
  return folded ? Met::kFolded : Met::kLost;
}

FresnelZone::FresnelZone(const PathFrame& frame) : way_m(frame.way_m) {
  const double longest_m = 2 * wavelength_m(0, frame.line.speed_of_sound_mps);
  for (std::size_t r = 0; r < kZoneRings; ++r) {
    const double detour_m = std::ldexp(longest_m, -static_cast<int>(r));
    area_m2_[r] = detour_m * (2 * way_m + detour_m);
  }
}

double FresnelZone::detour_m(std::size_t ring, int i) const {
  const double outer_m2 = area_m2_[ring], inner_m2 = area_m2_[ring + 1];
  const double across_m2 =
      inner_m2 + (outer_m2 - inner_m2) * places().across[static_cast<std::size_t>(i)];
  return std::sqrt(way_m * way_m + across_m2) - way_m;
}

// Are both nothing but free ways, or nothing but blocked ones?
bool FresnelZone::agree(std::size_t a, std::size_t b) const {
  return !rings[a].mixed() && !rings[b].mixed() &&
         (rings[a].counted == 0 || rings[b].counted == 0 ||
          (rings[a].free > 0) == (rings[b].free > 0));
}

bool FresnelZone::is_settled(std::size_t ring) const {
  return (ring == 0 || agree(ring, ring - 1)) && (ring + 1 == kZoneRings || agree(ring, ring + 1));
}

// Free share of ring r and all within it. Where no way could be told, what is within speaks.
std::array<float, kZoneRings> FresnelZone::discs() const {
  std::array<float, kZoneRings> discs{};
  discs[kZoneRings - 1] = rings[kZoneRings - 1].share();
  for (std::size_t r = kZoneRings - 1; r-- > 0;) {
    const auto within = static_cast<float>(area_m2_[r + 1] / area_m2_[r]);
    discs[r] = rings[r].counted > 0 ? within * discs[r + 1] + (1 - within) * rings[r].share()
                                    : discs[r + 1];
  }
  return discs;
}

Bands FresnelZone::visibility() const {
  const auto free = discs();
  Bands visibility{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const auto inner = static_cast<float>(kInnerWeight);
    const float a = diffracted_amplitude(inner * free[b + 1] + (1 - inner) * free[b]);
    visibility[b] = a * a;
  }
  return visibility;
}

}  // namespace clamor
