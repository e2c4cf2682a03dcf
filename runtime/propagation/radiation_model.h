// radiation_model.h: intensity of a source at a place (received_intensity.h), and its upper bounds.
//
// The weighted sum of a source's bands has an upper bound that costs a hundredth of the sum; the
// sampler rejects almost all sources by it (source_page.h). It is the density_bound() of
// common/reflection_law-inl.h with the weighted power in its coefficients, over the square of the
// distance, at least of the patch radius. `fall` is the lowest exponent p, and air transmits at
// most everything. An emitter has a lobe only, ((1 + cos a) / 2)^p <= exp(-p (1 - cos a) / 2), on
// all sides.
//
// Any thread may call it, but for the emitters that update_signal() changes.
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
#include "formats/level/emitter.h"
#include "runtime/propagation/band_mix.h"
#include "runtime/propagation/intensity_kernel.h"
#include "runtime/propagation/late_boost.h"
#include "runtime/propagation/received_intensity.h"

namespace clamor {

class RadiationModel {
 public:
  // `emitters` must outlive the model. All sources must have valid emitter and material indices.
  RadiationModel(const std::vector<Emitter>& emitters, std::span<const Material> materials,
                 const Air& air, const LateBoost& late_boost = {});

  std::size_t emitter_count() const { return emitters_.size(); }
  std::uint32_t signal(const Source& source) const { return signal(source.emitter); }
  std::uint32_t signal(std::uint32_t emitter) const { return timings_[emitter].signal; }

  // Takes over the signal of an emitter that has changed. Meanwhile no other thread may use its
  // sources.
  void update_signal(std::size_t emitter) { timings_[emitter].signal = emitters_[emitter].signal; }

  // Intensity per band at `place`: the square of an amplitude.
  Bands intensity(const Source& source, const Vec3& place) const {
    const Source* const one = &source;
    ReceivedIntensity received;
    receive({&one, 1}, place, &received);
    return received.intensity;
  }
  // Intensities of many sources, with the same bits in a fifth of the time (intensity_kernel.h).
  void receive(std::span<const Source* const> sources, const Vec3& place,
               ReceivedIntensity* received) const {
    clamor::receive(radiation_, sources, place, received);
  }

  // The BRDFs of the materials and the directivity of an emitter.
  const ReflectionLaws& laws() const { return laws_; }
  const ReflectionTable& rows(std::size_t material) const {
    return radiation_.laws[radiation_.law_of[material]];
  }
  std::size_t material_count() const { return radiation_.law_of.size(); }
  const Bands& directivity(const Source& emitter) const {
    return emitters_[emitter.emitter].directivity;
  }

  double speed_of_sound_mps() const { return speed_of_sound_mps_; }

  // Time from the signal's start to its arrival at `place`.
  double delay_s(const Source& source, const Vec3& place) const {
    return delay_s(source, length(place - Vec3(source.position_m)));
  }
  double delay_s(const Source& source, double distance_m) const {
    return emission_time_s(source) + distance_m / speed_of_sound_mps_;
  }

  // Time from the signal's start to its emission by the source.
  double emission_time_s(const Source& source) const {
    return emission_time_s(source.emitter, source.delay_s);
  }
  double emission_time_s(std::uint32_t emitter, float delay_s) const {
    return timings_[emitter].delay_s + static_cast<double>(delay_s);
  }

  // Times at which the first and the last emitter start to play.
  double earliest_start_s() const { return earliest_start_s_; }
  double latest_start_s() const { return latest_start_s_; }

  // Priority boost of late reflections.
  const LateBoost& late_boost() const { return late_boost_; }

  // Upper bound of the weighted sum of bands at 1 m, and of each band's share of it, in any
  // direction.
  struct UpperBound {
    float diffuse = 0, compensation = 0, slope = 0, lobe = 0, fall = 0;
    BandMix mix;
  };
  UpperBound upper_bound(const Source& source, const Bands& weight) const;

  // Upper bound per band at 1 m without air attenuation, in any direction.
  Bands max_intensity(const Source& source) const;

  // Upper bound of weight x intensity per unit of power in a band, at 1 m without air attenuation,
  // over all sources and directions; `weights` are per signal, and emitters of others are left out.
  Bands max_weight_per_power(std::span<const Bands> weights) const;
  const Bands& air_loss_per_m() const { return air_loss_per_m_; }
  // Attenuation as an exponent of 2: energy falls as 2^(-loss r).
  const Bands& air_log2_loss_per_m() const { return radiation_.air_log2_loss_per_m; }

 private:
  // The emitter values that are read most, so that thousands fit in the cache.
  struct EmitterTiming {
    double delay_s = 0;
    std::uint32_t signal = 0;
  };

  const std::vector<Emitter>& emitters_;
  std::vector<EmitterTiming> timings_;
  ReflectionLaws laws_;
  RadiationTables radiation_;
  LateBoost late_boost_;
  Bands air_loss_per_m_;
  double speed_of_sound_mps_;
  double earliest_start_s_ = 0, latest_start_s_ = 0;
};

}  // namespace clamor
