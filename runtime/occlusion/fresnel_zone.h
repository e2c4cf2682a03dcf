// fresnel_zone.h: one way round, and one zone of them, for those who cast them (the model is in
// fresnel_visibility.h): one at a time there, many sources side by side in occlusion_batch.cpp.
// Where a way runs, and what it means that it is free, is the same for both, to the last bit.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/fresnel_visibility.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

// Ring r lies between detours of 2^(1-r) and 2^-r wavelengths of the lowest band, the last one
// within: disc(b + 1) is the zone of band b.
inline constexpr std::size_t kZoneRings = kBandCount + 1;

// Straight from source to listener, and what is aside of that.
struct PathFrame {
  explicit PathFrame(const LineOfSight& line);

  LineOfSight line;
  Vec3 way;
  double way_m;
  Basis basis;  // of none where the way has no length
};

struct PathAzimuth {
  explicit PathAzimuth(double rad) : cos(std::cos(rad)), sin(std::sin(rad)) {}
  double cos, sin;
};

// To which side the ring's i-th way goes: any first few of them lie evenly over the ring half way.
const PathAzimuth& path_azimuth(std::size_t ring, int i);

// A way round of four straight pieces; piece i runs from at[i - 1] to at[i].
struct Way {
  static constexpr std::size_t kPieces = 4;

  // To the side that turns from the basis' tangent as this does.
  Way(const PathFrame& frame, double detour_m, const PathAzimuth& turn);

  // What the first surface that piece i meets makes of it: folds it at the surface, which it may
  // then meet others behind of; ends it, or loses it between walls.
  enum class Met : std::uint8_t { kFolded, kBlocked, kLost };
  Met meet(const OccluderPlane& wall, std::size_t piece, const LineOfSight& line);

  std::array<Vec3f, kPieces + 1> at;
  int folds = 0;
};

struct ZoneRing {
  int cast = 0, free = 0, counted = 0;

  bool mixed() const { return free > 0 && free < counted; }
  float share() const {
    return counted > 0 ? static_cast<float>(free) / static_cast<float>(counted) : 0;
  }
  // Does it contradict the straight line?
  bool contradicts(bool straight) const {
    return mixed() || (counted > 0 && (free > 0) != straight);
  }
};

struct FresnelZone {
  explicit FresnelZone(const PathFrame& frame);

  // Detour of the ring's i-th way.
  double detour_m(std::size_t ring, int i) const;

  // Is it clear what the ring is without more ways: do its neighbours say the same?
  bool is_settled(std::size_t ring) const;

  // Of what was cast.
  Bands visibility() const;

  double way_m;
  std::array<ZoneRing, kZoneRings> rings{};

 private:
  // Of the zone that a ring and all within it make up half way; but for a factor.
  std::array<double, kZoneRings + 1> area_m2_{};
  bool agree(std::size_t a, std::size_t b) const;
  std::array<float, kZoneRings> discs() const;
};

}  // namespace clamor
