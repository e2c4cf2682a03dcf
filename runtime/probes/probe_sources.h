// probe_sources.h: the secondary sources of a probe, moved to where a moving source is.
//
// A probe's tree holds what an omnidirectional source of gain 1 at the probe leaves on the
// surfaces. A source of sound at another place x near by leaves nearly the same. Each secondary
// source knows the first leg of its path (first_leg.h), from the probe p to the first surface at h,
// so three things are corrected:
//
//   delay        longer by (|h - x| - |h - p|) / c
//   directivity  of the moving source, in the direction h - x
//   power        of sources on the first surface, by the irradiance there of a source at x over
//                that of one at p:  (cos x / |h - x|^2) / (cos p / |h - p|^2), at most
//                kMaxIrradianceRatio
//
// and the mirror direction of sources on the first surface is that of sound from x. First
// reflections are therefore those of the source's own place, as far as the same surfaces are seen
// from there; all later ones are those of the probe, with the delay of the source's place.
//
// What only the source sees is missing. At 8 places in Sponza first reflections have 7 % too little
// power, and at one of them 28 %. A thousand rays from the source's very place instead bring C80
// there from 1.1 to 0.9 dB rms, and the direct-to-reverberant ratio above the stands of a stadium
// from 2.5 to 1.0 dB; but 1000 moving sources would cast a million rays in each keyframe.
//
// The late reflections of a zone (bake/probes/probe_zones.h) come from all its probes together, and
// stand for those of a source anywhere in it: only the directivity applies. They radiate by the
// cosine law, as surfaces do in a diffuse field whatever their reflection law is: a listener is in
// few of the lobes, so fewer sources give the same accuracy.
//
// Moving the first vertex of a path and reweighing it is the reconnection shift of gradient-domain
// and resampled path tracing (M. Kettunen et al. Gradient-Domain Path Tracing. ACM TOG 34(4),
// 2015).
#pragma once

#include <memory>
#include <vector>

#include "common/bands.h"
#include "common/vec.h"
#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/first_leg.h"
#include "formats/bake_file/source.h"
#include "runtime/propagation/radiation_model.h"
#include "runtime/propagation/source_bound.h"
#include "runtime/streaming/page_loader.h"

namespace clamor {

// Near a wall that its probe is far from, a source gives that wall at most so many times the power
// that the probe gives it; upper bounds of priorities use it.
inline constexpr double kMaxIrradianceRatio = 8;
inline constexpr double kLeastDistance_m = 0.05;  // of a source to a surface that it illuminates

// A moving source as probes see it.
struct MovingRadiator {
  Vec3 position_m{};
  Vec3 axis{0, 0, -1};
  Bands directivity{};  // exponents; all 0: omnidirectional
};

// Moves a secondary source of the probe at `probe_m`. `stored` has its first leg as its emitter.
Source early_reflection(const Source& stored, const Vec3& probe_m, const MovingRadiator& radiator,
                        double speed_of_sound_mps);

// The irradiance that the probe at `probe_m` causes at a source on the first surface, up to a
// constant.
double irradiance_of_probe(const Source& stored, const Vec3& probe_m);

// Applies the directivity to a secondary source of a zone, which gets this material: that of
// late_reflection_material().
Source late_reflection(const Source& stored, const MovingRadiator& radiator,
                       std::uint16_t material);

// A material that reflects by the cosine law, to be added behind the level's.
Material late_reflection_material();

// ProbeBounds makes the bounds that pages of probes are culled with, for a signal of this loudness
// in each band.
class ProbeBounds {
 public:
  ProbeBounds(std::span<const Material> materials, const Air& air, const LateBoost& late_boost);

  const RadiationModel& radiation() const { return radiation_; }
  const Bands& weights() const { return weights_[0]; }
  std::span<const Bands> weights_by_signal() const { return weights_; }
  // The last material, late_reflection_material().
  std::uint16_t late_material() const {
    return static_cast<std::uint16_t>(radiation_.material_count() - 1);
  }

  // Sources of which the page holds bounds: the stored ones, except that a source on the first
  // surface, whose power and mirror direction change, is bounded in all directions.
  // Those of a zone have the last material.
  std::vector<Source> bounding_sources(std::span<const Source> stored, bool of_zone) const;

  // Returns a bound for each source: on the first surface that for sound from the probe's distance,
  // whatever its direction, and an empty one elsewhere. A zone has none at all.
  std::vector<SourceBound> first_reflections(std::span<const Source> stored, bool of_zone) const;

 private:
  std::vector<Emitter> emitters_;  // one, omnidirectional
  std::vector<Bands> weights_;     // of its signal
  RadiationModel radiation_;
};

// Reads pages of probes for a loader. Everything must outlive what comes out.
PageLoader::Fetch probe_page_fetch(const BakeFile& file, const ProbeBounds& bounds);

}  // namespace clamor
