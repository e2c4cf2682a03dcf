// fresnel_visibility.h: occlusion with diffraction: the share of a source's power that passes the
// level's surfaces on its way to the listener, per octave band.
//
// Rays estimate the unoccluded fraction of the zone around the straight line that each band passes
// through (runtime/README.md, "Visibility and late reflections"). Each ray is a detour path of four
// straight segments from the source along half an ellipse to the listener. With D(d) the unoccluded
// fraction of the paths with a detour of at most d, weighted evenly over their cross-section half
// way, f_k that of detours from 2^k to 2^(k + 1) wavelengths, and l the wavelength at the band's
// centre (the first Fresnel zone ends at d = l / 2),
//
//   S = 0.7 D(l) + 0.3 D(2 l),     visibility V = max(curve(S)^2, 0.36^2 sum over k f_k^2 / 2^k),
//
//   S         0   0.01   0.06    0.275   0.375   0.5    0.74 and more
//   curve(S)  0   0.15   0.185   0.295   0.39    0.59   1
//
// Where the straight line is free, one edge leaves S of 0.5 and more. Less is that of an opening,
// and what falls on an opening passes it: with F the unoccluded fraction of the paths with a detour
// of at most 2^-7 wavelengths of the lowest band, S < 0.5 gives
// V + max(2 F - 1, 0) (curve(1 - S)^2 - V).
//
// A surface occludes only if source and listener lie on different sides of its plane: what a floor
// cuts off is the image source's, which the bake accounts for. A path that meets any other surface
// is reflected there.
//
// Threads: any.   Cost: 12 paths where the line and three rings agree, else kMediumPaths or
// kFinePaths for each of nine rings.
#pragma once

#include <cstdint>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

// A source's ray origin, the listener, and the speed of sound that turns bands into wavelengths.
struct LineOfSight {
  Vec3f from_m{}, to_m{};
  double speed_of_sound_mps = 343.2;
};

// The line or its reverse, the same for both. Direct sounds take its zone, so that they are the
// same there and back: paths that are reflected differ with the end that they begin at.
LineOfSight either_way(const LineOfSight& line);

// The curve above: amplitude that an unoccluded fraction of the zone lets pass.
float diffracted_amplitude(float free_fraction);

// Wavelength at the centre of a band.
double wavelength_m(std::size_t band, double speed_of_sound_mps);

// Paths per ring, half of them for rings that are not mixed. A medium estimate takes 70 rays in a
// furnished room, with 9 of 10 bands within 1 dB; a fine one is within 1 dB of any larger number.
inline constexpr int kMediumPaths = 8, kFinePaths = 64;

// Share of the power that arrives, per band. Adds the rays cast to `rays`, and sets
// `line_is_free` to whether the straight line is unoccluded.
Bands fresnel_visibility(const OcclusionGeometry& geometry, const LineOfSight& line,
                         int paths_per_ring, std::uint64_t& rays, bool* line_is_free = nullptr);

}  // namespace clamor
