// radiation_model.h: what a source gives at a place (received_intensity.h), and ceilings of that.
//
// A weighted sum of a source's bands has a ceiling that costs a hundredth of the sum; the sampler
// rejects almost all sources by it (source_culler.h). With a the angle to the lobe's direction,
//
//   sum_b weight_b I_b <= (diffuse cos o + bounce x exp(-slope x)
//                          + lobe min(1, cos o / cos i) exp(-fall (1 - cos a)))
//                         / max(r, source radius)^2,   x = min(cos o, 1 / slope),
//
// because cos^p a <= exp(-p (1 - cos a)), p at least `fall`, and the air only takes. `bounce` is
// what the lobe loses at the surface and gives back (reflection.h); x makes it grow with cos o, so
// that the most of some directions is that of the highest. An emitter is all lobe,
// ((1 + cos a) / 2)^p <= exp(-p (1 - cos a) / 2), and heard on all sides.
//
// Immutable once made; any thread may ask.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/air.h"
#include "common/bands.h"
#include "common/material.h"
#include "common/reflection.h"
#include "common/vec.h"
#include "formats/bake_file/source.h"
#include "formats/level/level.h"
#include "runtime/propagation/band_mix.h"
#include "runtime/propagation/intensity_kernel.h"
#include "runtime/propagation/late_boost.h"
#include "runtime/propagation/received_intensity.h"

namespace clamor {

class RadiationModel {
 public:
  // `emitters` must outlive the field. Sources' indices must point into both.
  RadiationModel(const std::vector<Emitter>& emitters, std::span<const Material> materials,
                 const Air& air, const LateBoost& late_boost = {});

  std::size_t emitter_count() const { return emitters_.size(); }
  std::uint32_t signal(const Source& source) const { return signal(source.emitter); }
  std::uint32_t signal(std::uint32_t emitter) const { return played_[emitter].signal; }

  // Intensity, not amplitude: the keyframe maker takes the root.
  Bands intensity(const Source& source, const Vec3& place) const {
    const Source* const one = &source;
    ReceivedIntensity received;
    receive({&one, 1}, place, &received);
    return received.intensity;
  }
  // Of many, to the same bits and in a fifth of the time (intensity_kernel.h).
  void receive(std::span<const Source* const> sources, const Vec3& place,
               ReceivedIntensity* received) const {
    clamor::receive(radiation_, sources, place, received);
  }

  // Of what sources are made: laws of materials, and how an emitter radiates.
  const ReflectionLaws& laws() const { return laws_; }
  const ReflectionTable& rows(std::size_t material) const {
    return radiation_.laws[radiation_.law_of[material]];
  }
  std::size_t material_count() const { return radiation_.law_of.size(); }
  const Bands& directivity(const Source& emitter) const {
    return emitters_[emitter.emitter].directivity;
  }

  double speed_of_sound_mps() const { return speed_of_sound_mps_; }

  // From the signal's start to a listener at `place`.
  double delay_s(const Source& source, const Vec3& place) const {
    return delay_s(source, length(place - Vec3(source.position_m)));
  }
  double delay_s(const Source& source, double way_m) const {
    return emission_time_s(source) + way_m / speed_of_sound_mps_;
  }

  // The same without the way from there to the listener.
  double emission_time_s(const Source& source) const {
    return emission_time_s(source.emitter, source.delay_s);
  }
  double emission_time_s(std::uint32_t emitter, float delay_s) const {
    return played_[emitter].delay_s + static_cast<double>(delay_s);
  }

  // Of all emitters: when the first and the last begins to play.
  double earliest_start_s() const { return earliest_start_s_; }
  double latest_start_s() const { return latest_start_s_; }

  // How much likelier late sources are to be chosen.
  const LateBoost& late_boost() const { return late_boost_; }

  // At 1 m, of the weighted sum of bands; and what parts of it they are, in any direction.
  struct Ceiling {
    float diffuse = 0, bounce = 0, slope = 0, lobe = 0, fall = 0;
    BandMix mix;
  };
  Ceiling ceiling(const Source& source, const Bands& weight) const;

  // Most that the source gives at 1 m per band, without the air, whatever the direction.
  Bands max_intensity(const Source& source) const;

  // Most that a power of 1 in a band is weighed as at 1 m, without the air, whatever source and
  // direction; `weights` are per signal.
  Bands max_weight_per_power(std::span<const Bands> weights) const;
  const Bands& air_loss_per_m() const { return air_loss_per_m_; }
  // The same in powers of 1/2.
  const Bands& air_log2_loss_per_m() const { return radiation_.air_log2_loss_per_m; }

 private:
  // What is asked of an emitter far more often than the rest, so that thousands stay in the cache.
  struct Played {
    double delay_s = 0;
    std::uint32_t signal = 0;
  };

  const std::vector<Emitter>& emitters_;
  std::vector<Played> played_;
  ReflectionLaws laws_;
  RadiationTables radiation_;
  LateBoost late_boost_;
  Bands air_loss_per_m_;
  double speed_of_sound_mps_;
  double earliest_start_s_ = 0, latest_start_s_ = 0;
};

}  // namespace clamor
