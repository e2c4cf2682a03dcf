// mirror_edges.h: the sound of an image source that the edges at one mirror diffract.
//
// In the space that the mirror unfolds, the image's path is straight, and there are three ways
// around edges. Their sound is that of edge_diffraction.h:
//
//   over a border of the mirror, with the terms of beta that its face reflects and those that the
//     direct sound is without, because source and listener are on one side of the edge,
//   over an edge behind the mirror, from the source's image to the listener,
//   over an edge before it, from the source to the listener's image, both with the terms of direct
//     sound. Two edges in a row count where the straight path is hidden.
//
// If other mirrors precede or follow, source and listener are their images in those, the ways are
// reflected by the planes of those without regard to their borders, and only the first way counts.
//
// Direct sound and image together are exact for an infinite rigid half-plane and wedge. A plate no
// wider than the wave needs the second order across its two sides, which is there for sheets and
// for plates that are thin to the wave: plates of 1 and 3 m reflect within 1.5 dB of the exact
// solution down to -10 dB, and 3.5 dB down to -20 dB (tests/physics/plate_test.cpp).
//
// A corner that points into the walls is no edge, and neither is a change of material. The 12
// nearest edges on either side of the mirror take part, within a detour of one wave of the lowest
// band; the farther half of them fades out.
//
// Threads: any.   Cost: two searches for edges, of 50 to 150 us in large levels; 20 to 40 rays and
// 10 us for each edge found.
#pragma once

#include <cstdint>
#include <vector>

#include "common/vec.h"
#include "runtime/occlusion/edge_diffraction.h"
#include "runtime/occlusion/mirror_path.h"
#include "runtime/occlusion/mirror_plane.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

struct MirrorEdges {
  // Sounds over edges, with places as if they came straight from the image: those before the
  // mirror are mirrored.
  std::vector<EdgeSound> sounds;
  Tones across{};  // second order across sheets that are mirrors, without a place
  // From 0 to 1 where the straight path passes within 2 kBlendRadius_m of an edge that is heard.
  double nearness = 0;
};

// Blend radius: within it, edges alone decide where a path ends; from twice that on, the path does.
inline constexpr double kBlendRadius_m = 0.15;

// One reflection of a path: its mirror, and both ends as they are seen from there.
struct Reflection {
  MirrorPlane plane;  // its normal points to the side of the path
  PathEnd from, to;
  bool is_only = true;      // of the path: then edges before and behind the mirror count as well
  bool is_in_part = false;  // the mirror is a movable part, not a surface of the level
};

// The sound over edges, relative to the free field of the image in the mirror. `is_hidden` says
// whether the straight path is blocked. Adds the rays cast to `rays`.
MirrorEdges sound_over_mirror_edges(const OcclusionGeometry& geometry, const Reflection& reflection,
                                    bool is_hidden, double speed_of_sound_mps, std::uint64_t& rays);

// Share of the power that surfaces reflect at a point of a mirror; 0 where there is none.
Bands reflected_at(const OcclusionGeometry& geometry, const MirrorPlane& plane,
                   const Vec3& point_m, bool is_in_part, std::uint64_t& rays);

}  // namespace clamor
