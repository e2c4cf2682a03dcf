// edge_in_air.h: an edge between a source and a listener, and which of its points are in sight.
//
// Threads: any.   Cost: a ray or two for each point.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/bands.h"
#include "common/vec.h"
#include "runtime/occlusion/diffracting_edges.h"
#include "runtime/occlusion/mirror_path.h"
#include "runtime/occlusion/occlusion_geometry.h"

namespace clamor {

// Frequencies at which pressures are added, three in each octave band.
inline constexpr std::size_t kTonesPerBand = 3, kTones = kTonesPerBand * kBandCount;
using Tones = std::array<std::complex<double>, kTones>;

// The wave number of a tone, in radians per metre. Tones are a third of an octave apart, around the
// bands' centres.
double wave_number(std::size_t tone, double speed_of_sound_mps);

// A wedge with more air is a sheet.
inline constexpr double kSheet_rad = 6.2;

// An edge, and which of its points are in sight.
class EdgeInAir {
 public:
  // Refers to all of them. Adds the rays cast to `rays`.
  EdgeInAir(const OcclusionGeometry& geometry, const DiffractingEdge& edge,
            double speed_of_sound_mps, std::uint64_t& rays);

  const DiffractingEdge& edge() const { return edge_; }
  // The range of z with the images at both ends; 0 is at edge().from_m.
  double first_m() const { return -before_m_; }
  double last_m() const { return length_m_ + beyond_m_; }
  double length_m() const { return length_m_; }

  Vec3 point_m(double z) const { return Vec3(edge_.from_m) + z * Vec3(edge_.along); }
  double wave_number(std::size_t tone) const {
    return clamor::wave_number(tone, speed_of_sound_mps_);
  }

  // An image fades out towards its end, so that the end diffracts nothing.
  double weight(double z) const;
  // Share of the edge in a tone: the corners of a narrow wall end are heard by short waves, the
  // sheet between them by long ones.
  double share(std::size_t tone) const;
  // The path from an end to the point at z, or to the one whose image it is; nothing if that is not
  // in sight.
  std::optional<MirrorPath> path_from(const PathEnd& end, double z) const;
  // Returns whether sound passes the edge at z: along the narrow face, if it is that of a sheet.
  bool is_open(double z) const;
  // Returns whether nothing is between the point at z and one of another edge.
  bool sees(double z, const EdgeInAir& other, double other_z) const;

 private:
  Vec3 place_m(double z) const;  // in the air close to the edge
  bool is_mirrored(double z, double direction) const;

  const OcclusionGeometry& geometry_;
  const DiffractingEdge& edge_;
  Vec3 start_m_;
  Vec3 aside_m_{0};  // from the middle of a sheet to one of the corners beside it
  double length_m_, before_m_ = 0, beyond_m_ = 0;
  double speed_of_sound_mps_;
  std::uint64_t& rays_;
};

}  // namespace clamor
