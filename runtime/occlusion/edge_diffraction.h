// edge_diffraction.h: the sound that edges diffract from a source to a listener, relative to the
// direct sound in a free field.
//
// The pressure is a line integral over the visible parts of an edge, exact for one infinite rigid
// wedge (runtime/README.md, "Visibility and late reflections"). With m and l the distances of a
// point z of the edge to source and listener, L the straight line, and nu = pi / (angle of the
// air),
//
//   p / p0 = -nu / (4 pi)  integral of  beta(z) L / (m l) exp(i k (m + l - L)) dz,
//   beta = sum over four signs of sin(phi) / (cosh(nu eta) - cos(phi)),
//   phi = nu (pi +- theta_source +- theta_listener),
//   cosh(eta) = (m l + (z - z_source) (z - z_listener)) / (r_source r_listener).
//
// Two edges in a row, as on a thick wall, are the product of two such integrals. To waves longer
// than twice its width, the end of a wall of two faces is one edge, that of a sheet
// (diffracting_edges.h); to waves shorter than half its width it is two; in between, both take
// their share. A face of a wedge that both points see also reflects: the diffraction of that
// reflection is the image source's (mirror_edges.h). An edge that ends at a surface at about a
// right angle, as a door's jamb does at the floor, goes on as its mirror image, and so does the
// sound.
//
// Threads: any.   Cost: an edge takes 20 rays and 10 us.
#pragma once

#include <span>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/diffracting_edges.h"
#include "runtime/occlusion/edge_in_air.h"
#include "runtime/occlusion/mirror_path.h"

namespace clamor {

// Power per band of a pressure, the mean of the band's tones.
Bands power_of(const Tones& pressure);

struct EdgeSound {
  Tones pressure{};
  bool is_heard = false;
  bool is_seen_by_source = false, is_seen_by_listener = false;  // any part of a single edge
  Vec3 first_m{}, last_m{};  // where the shortest path in sight leaves the source and arrives from
  double path_m = 0;         // its length
};

// Power per band of sounds that arrive together, and of a straight one, the mean of the band's
// thirds. Within a third of an octave, sounds of different paths interfere the less the more waves
// their lengths differ by.
Bands power_of(const Tones& straight, double straight_m, std::span<const EdgeSound> sounds,
               double speed_of_sound_mps);

// Sound over one edge.
EdgeSound sound_over_edge(const EdgeInAir& edge, const PathEnd& from, const PathEnd& to);

// Sound over one edge and then another.
EdgeSound sound_over_edges(const EdgeInAir& first, const EdgeInAir& second, const PathEnd& from,
                           const PathEnd& to);

// Sound that the border of a mirror, the first face of the edge, diffracts to a listener before it:
// what that face reflects, and what is not part of the direct sound. It is relative to the free
// field of a source's image.
EdgeSound sound_over_border(const EdgeInAir& border, const PathEnd& from, const PathEnd& to,
                            const Vec3& image_m);

}  // namespace clamor
