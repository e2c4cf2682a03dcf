// fresnel_visibility.h: occlusion with diffraction: the share of a source's power that passes the
// level's surfaces on its way to the listener, per octave band.
//
// Sound reaches the listener through a zone around the straight line from the source, wide for low
// bands and narrow for high ones: a pillar attenuates 8 kHz and lets 63 Hz pass. Rays estimate the
// unoccluded fraction of the zone (N. Tsingos, J.-D. Gascuel. Soundtracks for Computer Animation:
// Sound Rendering in Dynamic Environments with Occlusions. Graphics Interface 1997). Each ray is a
// detour path from the source along half an ellipse to the listener. A path has four straight
// segments, because an edge may lie anywhere along it. With D(d) the unoccluded fraction of the
// paths with a detour of at most d, weighted evenly over their cross-section half way, and l the
// wavelength at the band's centre (the first Fresnel zone ends at d = l / 2),
//
//   S = 0.7 D(l) + 0.3 D(2 l),     amplitude a = curve(S),     visibility V = a^2.
//
// The first Fresnel zone alone does not suffice. At the shadow boundary of a rigid half-plane the
// exact amplitude is one half; in the shadow it falls as 1 / sqrt(detour) and never reaches zero;
// on the lit side it is back to one where the edge clears 0.6 of the zone. The curve is fitted to
// the exact half-plane solution at 270 pairs of source and listener:
//
//   S  0   0.01   0.06    0.275   0.375   0.5    0.74 and more
//   a  0   0.15   0.185   0.295   0.39    0.59   1
//
// The fit is within 2.1 dB of the exact solution wherever that is above -15 dB. In deeper shadow, the
// visibility is at least that of the paths of longer detours,
//
//   V = 0.36^2 sum over k of f_k^2 / 2^k,
//
// with f_k the unoccluded fraction of the paths with detours from 2^k to 2^(k + 1) wavelengths, as
// far as the paths of the lowest band go.
//
// The sum over zones with their phases (Kirchhoff's integral) was no better: 3.5 dB too low near
// shadow boundaries, where a rigid screen adds its reflection, and twice as noisy for the same number
// of rays. At small openings an unoccluded fraction is too low: a slit that passes -3 dB is estimated
// at -10 dB. Direct sounds take the edges of openings into account instead (direct_sound.h).
//
// Surfaces beside the path. A floor also cuts the zone but takes nothing from the direct sound: the
// missing part is the image source's, which the bake accounts for. A surface therefore occludes
// only if source and listener lie on different sides of its plane. A path that meets any other
// surface is reflected at that surface. In a convex room no source is ever occluded. A listener who
// steps through an opening crosses the plane of its wall, and there the wall begins to occlude:
// first those paths that meet it at right angles, as seen by the listener.
//
// One set of paths serves all bands, because each band's zone lies within that of the next lower
// band: rays sample the rings between the zones. Most rays go to rings with both free and blocked
// paths. Where the straight line and three rings agree that a source is visible, 12 paths suffice.
#pragma once

#include <cstdint>
#include <optional>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

// A source's ray origin, the listener, and the speed of sound that turns bands into wavelengths.
struct LineOfSight {
  Vec3f from_m{}, to_m{};
  double speed_of_sound_mps = 343.2;
};

// The curve above: amplitude that an unoccluded fraction of the zone lets pass.
float diffracted_amplitude(float free_fraction);

// Wavelength at the centre of a band.
double wavelength_m(std::size_t band, double speed_of_sound_mps);

// Returns whether the path that is `detour_m` longer than the straight line, on the side given by
// `azimuth_rad`, is unoccluded. `chance` in [0, 1) decides where the listener is close behind the
// plane of a wall. Nothing if the path gets lost between surfaces.
std::optional<bool> path_is_free(const OcclusionGeometry& geometry, const LineOfSight& line,
                                 double detour_m, double azimuth_rad, double chance,
                                 std::uint64_t& rays);

// Paths per ring, half of them for rings that are not mixed. A medium estimate takes 70 rays in a
// furnished room, with 9 of 10 bands within 1 dB; a fine one is within 1 dB of any larger number.
inline constexpr int kMediumPaths = 8, kFinePaths = 64;

// Share of the power that arrives, per band. Adds the rays cast to `rays`, and sets
// `line_is_free` to whether the straight line is unoccluded.
Bands fresnel_visibility(const OcclusionGeometry& geometry, const LineOfSight& line,
                         int paths_per_ring, std::uint64_t& rays, bool* line_is_free = nullptr);

}  // namespace clamor
