// fresnel_visibility.h: how much of a source gets past what stands in the way, per octave band.
//
// Sound does not only go straight: what arrives has come through a zone round the line from source
// to listener, wide for low bands and narrow for high ones, so that a pillar dims 8 kHz and lets
// 63 Hz through. Rays ask which share of the zone is free (N. Tsingos, J.-D. Gascuel. Soundtracks
// for Computer Animation: Sound Rendering in Dynamic Environments with Occlusions. Graphics
// Interface 1997). A ray is a way round: from the source, along half an ellipse, to the listener,
// as four straight pieces, because an edge may lie anywhere between. With D(d) the share of the
// ways with a detour of at most d that are free, evenly over their area half way, and l the
// wavelength at the band's centre (the first Fresnel zone ends at d = l / 2),
//
//   S = 0.7 D(l) + 0.3 D(2 l),     amplitude a = curve(S),     visibility V = a^2.
//
// The first zone alone cannot do it: at the edge of a rigid half-plane's shadow the exact amplitude
// is a half, in the shadow it falls as 1 / sqrt(detour) and never ends, and on the lit side sound
// is whole again when the edge has come to 0.6 of the zone. The curve is the exact solution's,
// fitted at 270 pairs of places:
//
//   S  0   0.01   0.06    0.275   0.375   0.5    0.74 and more
//   a  0   0.15   0.185   0.295   0.39    0.59   1
//
// It is within 2.1 dB of exact wherever that is above -15 dB; below -17 dB it ends. The sum over
// zones with their phases (Kirchhoff's integral) was no better: 3.5 dB too low near the edge of
// shadows, where a rigid screen adds what it reflects, and with as many rays twice as noisy. It is
// better at small openings, where a share is too low: a slit that lets -3 dB through gets -10 dB.
//
// Walls along the way. A floor cuts the zone, too, but takes nothing from the direct sound: what
// would have come from below comes from its mirror image, and of that the bake knows. So a surface
// blocks only if source and listener are on different sides of its plane; a way that meets one
// which has both before it is folded at it, as a mirror would. In a convex room nothing is ever
// hidden.
//
// One set of ways serves all bands, as each zone lies within that of the next lower band: rays ask
// for the rings between them. Most are spent where some ways are free and others not; where the
// straight line and three rings agree that a source is in plain sight, a dozen ways are all.
#pragma once

#include <cstdint>
#include <optional>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

// From where to where, and the speed of sound that makes wavelengths of bands.
struct LineOfSight {
  Vec3f from_m{}, to_m{};
  double speed_of_sound_mps = 343.2;
};

// The amplitude that a free share of the zone lets through: the curve.
float diffracted_amplitude(float free_share);

// Wavelength at the centre of a band.
double wavelength_m(std::size_t band, double speed_of_sound_mps);

// A way round that is `detour_m` longer than the straight one, on the side that `turn_rad` says.
// Nothing if it gets lost between walls.
std::optional<bool> path_is_free(const OcclusionGeometry& geometry, const LineOfSight& line,
                                 double detour_m, double turn_rad, std::uint64_t& rays);

// Ways per ring, half of them where rings are not mixed: for a quick look at one of many; for a
// first look (70 rays on average in a
// furnished room, 9 of 10 bands within 1 dB), and for one that is within 1 dB of any number of
// ways.
inline constexpr int kCoarsePaths = 4, kMediumPaths = 8, kFinePaths = 64;

// Share of the power that arrives, per band. `rays` grows by those cast; `straight` says whether
// the straight line is free.
Bands fresnel_visibility(const OcclusionGeometry& geometry, const LineOfSight& line,
                         int paths_per_ring, std::uint64_t& rays, bool* straight = nullptr);

}  // namespace clamor
