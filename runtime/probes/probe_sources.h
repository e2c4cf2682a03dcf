// probe_sources.h: the secondary sources of a probe, moved to where a moving source is.
//
// A probe's tree holds what an omnidirectional source of gain 1 at the probe leaves on the
// surfaces, but for its first reflections. A source of sound at another place x near by leaves
// nearly the same. Each secondary source knows the first leg of its path (first_leg.h), from the
// probe p to the first surface at h, so two things are corrected:
//
//   delay        longer by (|h - x| - |h - p|) / c
//   directivity  of the moving source, in the direction h - x
//
// First reflections depend the most on the place of the source. The runtime traces them from a
// place p that the source has been at (first_reflections.h). They get the same corrections with
// themselves at h, and
//
//   power        times the irradiance at h of a source at x over that of one at p:
//                (cos x / |h - x|^2) / (cos p / |h - p|^2), at most kMaxIrradianceRatio
//
// and their mirror direction is that of sound from x. First reflections of the probe, moved in
// this way, are not good enough: at 8 places in Sponza they have 7 % too little power, and at one
// of them 28 %, because a source sees other surfaces than its probes. Traced from the source's
// place instead, they bring C80 there from 0.9 to 0.6 dB rms.
//
// The late reflections of a zone (bake/probes/probe_zones.h) come from all its probes together, and
// stand for those of a source anywhere in it: only the directivity applies. They radiate by the
// cosine law, with powers that the bake has made for it (bake/probes/diffuse_late_field.h).
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
#include "runtime/streaming/page_loader.h"

namespace clamor {

// A source gives a surface at most so many times the power that the place gives it that its first
// reflections were traced from; upper bounds of priorities use it.
inline constexpr double kMaxIrradianceRatio = 2;
inline constexpr double kLeastDistance_m = 0.05;  // of a source to a surface that it illuminates

// A moving source as probes see it.
struct MovingRadiator {
  Vec3 position_m{};
  Vec3 axis{0, 0, -1};
  Bands directivity{};  // exponents; all 0: omnidirectional
};

// Moves a secondary source of the probe at `probe_m`.
Source early_reflection(const Source& stored, const Vec3& probe_m, const MovingRadiator& radiator,
                        double speed_of_sound_mps);

// Moves a first reflection of sound that left `from_m`.
Source first_reflection(const Source& stored, const Vec3& from_m, const MovingRadiator& radiator,
                        double speed_of_sound_mps);

// The irradiance at a surface of a source so far away, up to a constant.
double irradiance_from(const Vec3& to_surface_m, const Vec3& normal);

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

  // The sources whose bounds the page holds: the stored ones. Sources of a zone have the last
  // material.
  std::vector<Source> bounding_sources(std::span<const Source> stored, bool of_zone) const;

 private:
  std::vector<Emitter> emitters_;  // one, omnidirectional
  std::vector<Bands> weights_;     // of its signal
  RadiationModel radiation_;
};

// Reads pages of probes for a loader. Everything must outlive what comes out.
PageLoader::Fetch probe_page_fetch(const BakeFile& file, const ProbeBounds& bounds);

}  // namespace clamor
