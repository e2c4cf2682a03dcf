#include "runtime/fresnel_visibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>

namespace clamor {

namespace {

constexpr int kMostFolds = 6;
constexpr double kInnerWeight = 0.7;

// Where between source and listener a way bends, and how far out compared with half way: a fifth
// more than the ellipse there, as its chords run inside it.
constexpr double kBend = 0.03, kWider = 1.2;

// Ring r lies between detours of 2^(1-r) and 2^-r wavelengths of the lowest band, the last one
// within: disc(b + 1) is the zone of band b.
constexpr std::size_t kRings = kBandCount + 1;

// Halton's points: any first few of them lie evenly.
double radical_inverse(std::uint32_t base, std::uint32_t i) {
  double value = 0, digit = 1;
  for (; i > 0; i /= base) {
    digit /= base;
    value += digit * (i % base);
  }
  return value;
}

struct Ring {
  int cast = 0, free = 0, counted = 0;

  bool mixed() const { return free > 0 && free < counted; }
  float share() const {
    return counted > 0 ? static_cast<float>(free) / static_cast<float>(counted) : 0;
  }
};

class Zone {
 public:
  Zone(const SightGeometry& geometry, const SightLine& line, std::uint64_t& rays)
      : geometry_(geometry),
        line_(line),
        way_m_(length(Vec3(line.to_m) - Vec3(line.from_m))),
        longest_m_(2 * wavelength_m(0, line.speed_of_sound_mps)),
        rays_(rays) {}

  // The ring's ways up to the `count`-th.
  void cast(std::size_t r, int count) {
    Ring& ring = rings_[r];
    const double outer_m2 = area_m2(r), inner_m2 = r + 1 < kRings ? area_m2(r + 1) : 0;
    for (; ring.cast < count; ++ring.cast) {
      const auto i = static_cast<std::uint32_t>(ring.cast);
      const double turn = radical_inverse(2, i) + kGolden * static_cast<double>(r);
      const double across_m2 = inner_m2 + (outer_m2 - inner_m2) * radical_inverse(3, i + 1);
      const double detour_m = std::sqrt(way_m_ * way_m_ + across_m2) - way_m_;
      const auto free = way_is_free(geometry_, line_, detour_m, 2 * std::numbers::pi * turn, rays_);
      if (!free) continue;
      ++ring.counted;
      ring.free += *free;
    }
  }
  const Ring& operator[](std::size_t r) const { return rings_[r]; }

  // Are both nothing but free ways, or nothing but blocked ones?
  bool agree(std::size_t a, std::size_t b) const {
    return !rings_[a].mixed() && !rings_[b].mixed() &&
           (rings_[a].counted == 0 || rings_[b].counted == 0 ||
            (rings_[a].free > 0) == (rings_[b].free > 0));
  }

  // Free share of ring r and all within it. Where no way could be told, what is within speaks.
  std::array<float, kRings> discs() const {
    std::array<float, kRings> discs{};
    discs[kRings - 1] = rings_[kRings - 1].share();
    for (std::size_t r = kRings - 1; r-- > 0;) {
      const auto within = static_cast<float>(area_m2(r + 1) / area_m2(r));
      discs[r] = rings_[r].counted > 0 ? within * discs[r + 1] + (1 - within) * rings_[r].share()
                                       : discs[r + 1];
    }
    return discs;
  }

 private:
  static constexpr double kGolden = 0.6180339887498949;

  // Of the zone that ring r and all within it make up half way; but for a factor.
  double area_m2(std::size_t r) const {
    const double detour_m = std::ldexp(longest_m_, -static_cast<int>(r));
    return detour_m * (2 * way_m_ + detour_m);
  }

  const SightGeometry& geometry_;
  const SightLine& line_;
  const double way_m_, longest_m_;
  std::uint64_t& rays_;
  std::array<Ring, kRings> rings_{};
};

}  // namespace

float diffracted_amplitude(float free_share) {
  constexpr float kShare[] = {0, 0.01f, 0.06f, 0.275f, 0.375f, 0.5f, 0.74f};
  constexpr float kAmplitude[] = {0, 0.15f, 0.185f, 0.295f, 0.39f, 0.59f, 1};
  for (std::size_t i = 1; i < std::size(kShare); ++i)
    if (free_share < kShare[i])
      return kAmplitude[i - 1] + (kAmplitude[i] - kAmplitude[i - 1]) *
                                     (free_share - kShare[i - 1]) / (kShare[i] - kShare[i - 1]);
  return 1;
}

double wavelength_m(std::size_t band, double speed_of_sound_mps) {
  return speed_of_sound_mps / (1000 * std::exp2(static_cast<double>(band) - 4));
}

std::optional<bool> way_is_free(const SightGeometry& geometry, const SightLine& line,
                                double detour_m, double turn_rad, std::uint64_t& rays) {
  const Vec3 from(line.from_m), way = Vec3(line.to_m) - from;
  const double way_m = length(way);
  if (!(way_m > 0)) return true;
  const Basis basis = basis_around(way / way_m);
  const Vec3 aside = std::cos(turn_rad) * basis.tangent + std::sin(turn_rad) * basis.bitangent;
  // Half the short axis of the ellipse of such ways, and the ellipse's width at the bends.
  const double out_m = std::sqrt(detour_m * (2 * way_m + detour_m)) / 2;
  const double slim = (1 - 2 * kBend) * way_m / (way_m + detour_m);
  const double bend_m = out_m * std::min(1.0, kWider * std::sqrt(1 - slim * slim));
  std::array<Vec3f, 5> at = {line.from_m, Vec3f(from + kBend * way + bend_m * aside),
                             Vec3f(from + 0.5 * way + out_m * aside),
                             Vec3f(from + (1 - kBend) * way + bend_m * aside), line.to_m};
  int folds = 0;
  for (std::size_t i = 1; i < at.size(); ++i) {
    for (;;) {
      ++rays;
      const SightPlane* const wall = geometry.first_surface(at[i - 1], at[i]);
      if (wall == nullptr) break;
      const bool before = wall->height_m(line.from_m) > 0;
      if (before != (wall->height_m(line.to_m) > 0)) return false;
      if (folds++ == kMostFolds) return std::nullopt;
      bool folded = false;
      for (std::size_t j = i; j + 1 < at.size(); ++j) {
        const float height_m = wall->height_m(at[j]);
        if ((height_m > 0) == before) continue;
        at[j] -= 2 * height_m * wall->normal;
        folded = folded || j == i;
      }
      if (!folded) return std::nullopt;
    }
  }
  return true;
}

Bands fresnel_visibility(const SightGeometry& geometry, const SightLine& line, int ways_per_ring,
                         std::uint64_t& rays, bool* straight_is_free) {
  if (straight_is_free != nullptr) *straight_is_free = true;
  if (geometry.empty()) return same_in_all_bands(1);
  Zone zone(geometry, line, rays);
  const int first_ways = (ways_per_ring + 1) / 2;

  // Most sources are in plain sight, where three rings tell enough, or behind a wall, where sound
  // may come through any.
  ++rays;
  const bool straight = geometry.is_free(line.from_m, line.to_m);
  if (straight_is_free != nullptr) *straight_is_free = straight;
  bool mixed = false;
  for (std::size_t r = 0; r < kRings; r += straight ? kRings / 2 : 1) {
    zone.cast(r, first_ways);
    mixed = mixed || zone[r].mixed() || (zone[r].counted > 0 && (zone[r].free > 0) != straight);
  }
  if (!mixed) return same_in_all_bands(straight ? 1 : 0);

  for (std::size_t r = 0; r < kRings; ++r) zone.cast(r, first_ways);
  std::array<bool, kRings> settled{};
  for (std::size_t r = 0; r < kRings; ++r)
    settled[r] = (r == 0 || zone.agree(r, r - 1)) && (r + 1 == kRings || zone.agree(r, r + 1));
  for (std::size_t r = 0; r < kRings; ++r)
    if (!settled[r]) zone.cast(r, ways_per_ring);

  const auto discs = zone.discs();
  Bands visibility{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const auto inner = static_cast<float>(kInnerWeight);
    const float a = diffracted_amplitude(inner * discs[b + 1] + (1 - inner) * discs[b]);
    visibility[b] = a * a;
  }
  return visibility;
}

}  // namespace clamor
