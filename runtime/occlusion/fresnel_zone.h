// fresnel_zone.h: the detour paths of one source and listener, and the rings that they sample (the
// model is in fresnel_visibility.h).
//
// fresnel_visibility() casts one path at a time, and occlusion_batch.cpp packets of neighbouring
// sources (zone_estimator.h). Paths and rings are the same in both, to the last bit.
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

// Ring r covers detours from 2^-r to 2^(1-r) wavelengths of the lowest band, and the last ring all
// shorter ones: the disc of ring b + 1 and all rings within it is the zone of band b.
inline constexpr std::size_t kZoneRings = kBandCount + 1;

// The straight line from source to listener, with a basis around it.
struct PathFrame {
  explicit PathFrame(const LineOfSight& line);

  LineOfSight line;
  Vec3 along_m;  // from source to listener
  double length_m;
  Basis basis;  // zero where the length is
};

// Angle around the straight line, from the basis' tangent.
struct PathAzimuth {
  explicit PathAzimuth(double rad) : cos(std::cos(rad)), sin(std::sin(rad)) {}
  double cos, sin;
};

// Azimuth of the ring's i-th path. Any first few of them are spread evenly over the ring.
const PathAzimuth& path_azimuth(std::size_t ring, int i);

// Chance of the i-th path of any ring.
double path_chance(int i);

// Effect of a surface on a path that meets it. A reflected path may meet more surfaces behind; a
// lost path got caught between surfaces and does not count.
enum class PathHit : std::uint8_t { kReflected, kBlocked, kLost };

// A path of four straight segments; segment i runs from points_m[i - 1] to points_m[i].
struct DetourPath {
  static constexpr std::size_t kSegments = 4;

  // `chance` in [0, 1) decides about walls that part the listener from the source by little: paths
  // with evenly spread chances make this gradual.
  DetourPath(const PathFrame& frame, double detour_m, const PathAzimuth& azimuth, double chance);

  // Applies the first surface that a segment meets.
  PathHit hit(const OccluderPlane& wall, std::size_t segment, const LineOfSight& line);

  bool is_passed(const OccluderPlane& wall, std::size_t segment, const LineOfSight& line) const;

  std::array<Vec3f, kSegments + 1> points_m;
  int reflections = 0;
  double chance = 0;
};

// Tally of a ring's paths: cast, with a known outcome (counted), and unoccluded (free).
struct ZoneRing {
  int cast = 0, free = 0, counted = 0;

  bool mixed() const { return free > 0 && free < counted; }
  float free_fraction() const {
    return counted > 0 ? static_cast<float>(free) / static_cast<float>(counted) : 0;
  }
  bool contradicts(bool line_is_free) const {
    return mixed() || (counted > 0 && (free > 0) != line_is_free);
  }
};

struct FresnelZone {
  explicit FresnelZone(const PathFrame& frame);

  // Detour of the ring's i-th path.
  double detour_m(std::size_t ring, int i) const;

  // Returns whether the neighbouring rings agree with this one, so that more paths would tell no
  // more.
  bool is_settled(std::size_t ring) const;

  // Share of the power that arrives, per band, from the paths cast so far.
  Bands visibility() const;

  double length_m;  // of the straight line
  std::array<ZoneRing, kZoneRings> rings{};

 private:
  // Cross-section half way of each ring with all rings within it, up to a common factor.
  std::array<double, kZoneRings + 1> area_m2_{};
  bool agree(std::size_t a, std::size_t b) const;
  std::array<float, kZoneRings> disc_fractions() const;
  float amplitude_of_long_detours(std::size_t band) const;
};

}  // namespace clamor
