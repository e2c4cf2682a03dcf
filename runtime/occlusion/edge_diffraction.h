// edge_diffraction.h: the sound that edges diffract from a source to a listener, relative to the
// direct sound in a free field.
//
// The pressure is a line integral over the visible parts of an edge, which is exact for one
// infinite rigid wedge, at any distance and angle (M. A. Biot, I. Tolstoy. J. Acoust. Soc. Am. 29,
// 1957; U. P. Svensson, R. I. Fred, J. Vanderkooy. An analytic secondary source model of edge
// diffraction impulse responses. J. Acoust. Soc. Am. 106, 1999). With m and l the distances of a
// point z of the edge to source and listener, L the straight line, and nu = pi / (angle of the
// air),
//
//   p / p0 = -nu / (4 pi)  integral of  beta(z) L / (m l) exp(i k (m + l - L)) dz,
//   beta = sum over four signs of sin(phi) / (cosh(nu eta) - cos(phi)),
//   phi = nu (pi +- theta_source +- theta_listener),
//   cosh(eta) = (m l + (z - z_source) (z - z_listener)) / (r_source r_listener).
//
// The sum with the direct sound, where that is in sight, is continuous. The edges of an opening add
// up to within 1.5 dB of the exact solution for an opening in a rigid screen, and within 2 dB where
// the opening is narrower than a twentieth of the wave (tests/physics/opening_test.cpp).
// Kirchhoff's integral is as good where the opening is several waves wide, and up to 15 dB too low
// where it is narrower than the wave.
//
// Two edges in a row, as on a thick wall, are the product of two such integrals (A. D. Pierce.
// Diffraction of sound around corners and over wide barriers. J. Acoust. Soc. Am. 55, 1974): the
// edge that bends the sound more is at the distance of the whole path from source and listener, the
// other is at its distance from the first. Where both edges bound one face, the product counts
// half, because sound along a rigid face is its own reflection.
//
// The end of a wall of two faces has two corners. To waves longer than twice its width they are one
// edge, that of a sheet (diffracting_edges.h), and first and second order would not do; to waves
// shorter than half its width they are two. In between, both take their share.
//
// A face of a wedge that both points see also reflects, which is not part of the direct sound: the
// diffraction of that reflection is the image source's (mirror_edges.h).
//
// An edge that ends at a surface at about a right angle, as a door's jamb does at the floor, goes
// on as its mirror image, and so does the sound.
//
// Cost: an edge takes 20 rays and 10 us.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/diffracting_edges.h"
#include "runtime/occlusion/mirror_path.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

// Frequencies at which pressures are added, three in each octave band.
inline constexpr std::size_t kTonesPerBand = 3, kTones = kTonesPerBand * kBandCount;
using Tones = std::array<std::complex<double>, kTones>;

// Power per band of a pressure, the mean of the band's tones.
Bands power_of(const Tones& pressure);

// An edge, and which of its points are in sight.
class EdgeInAir {
 public:
  // Adds the rays cast to `rays`, which must outlive this.
  EdgeInAir(const OcclusionGeometry& geometry, const DiffractingEdge& edge, std::uint64_t& rays);

  const DiffractingEdge& edge() const { return edge_; }
  // The range of z with the images at both ends; 0 is at edge().from_m.
  double first_m() const { return -before_m_; }
  double last_m() const { return length_m_ + beyond_m_; }
  double length_m() const { return length_m_; }

  // An image fades out towards its end, so that the end diffracts nothing.
  double weight(double z) const;
  // Share of the edge in a tone: the corners of a narrow wall end are heard by short waves, the
  // sheet between them by long ones.
  double share(std::size_t tone, double speed_of_sound_mps) const;
  // The path from an end to the point at z, or to the one whose image it is; nothing if that is not
  // in sight.
  std::optional<MirrorPath> path_from(const PathEnd& end, double z) const;
  // Returns whether sound passes the edge at z: along the narrow face, if it is that of a sheet.
  bool is_open(double z) const;
  // A place in the air close to the edge.
  Vec3 place_m(double z) const;

 private:
  bool is_mirrored(double z, double direction) const;

  const OcclusionGeometry& geometry_;
  const DiffractingEdge& edge_;
  Vec3 start_m_;
  Vec3 aside_m_{0};  // from the middle of a sheet to one of the corners beside it
  double length_m_, before_m_ = 0, beyond_m_ = 0;
  std::uint64_t& rays_;
};

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
EdgeSound sound_over_edge(const EdgeInAir& edge, const PathEnd& from, const PathEnd& to,
                          double speed_of_sound_mps);

// Sound over one edge and then another. Adds the rays cast to `rays`.
EdgeSound sound_over_edges(const OcclusionGeometry& geometry, const EdgeInAir& first,
                           const EdgeInAir& second, const PathEnd& from, const PathEnd& to,
                           double speed_of_sound_mps, std::uint64_t& rays);

// Sound that the border of a mirror, the first face of the edge, diffracts to a listener before it:
// what that face reflects, and what is not part of the direct sound. It is relative to the free
// field of a source's image.
EdgeSound sound_over_border(const EdgeInAir& border, const Vec3& from_m, const Vec3& to_m,
                            const Vec3& image_m, double speed_of_sound_mps);

// Sound that goes along both sides of a sheet from one border to another, relative to the same. It
// matters where the sheet is no wider than the wave.
Tones sound_across_sheet(const EdgeInAir& first, const EdgeInAir& second, const Vec3& from_m,
                         const Vec3& to_m, const Vec3& image_m, double speed_of_sound_mps);

}  // namespace clamor
