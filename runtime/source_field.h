// source_field.h: the intensity that each source of a bake gives at a place, per band.
//
//   emitter      gain^2 x emission(p_b, cos a) x air_b(r) / max(r, 0.1 m)^2
//   secondary    power_b x density_b(cos i, cos o, cos a) x air_b(r) / max(r, patch radius)^2
//
// with air_b(r) = exp(-loss_b r). Intensity, not amplitude: the keyframe maker takes the root.
// A sum of the eight bands, each times a weight, has an upper bound that costs one division; the
// sampler rejects almost all sources by it.
//
// Immutable once made; any thread may ask.
#pragma once

#include <cstdint>
#include <vector>

#include "common/bands.h"
#include "common/reflection.h"
#include "common/vec.h"
#include "runtime/auralizer_input.h"

namespace clamor {

inline constexpr double kNearestEmitter_m = 0.1;  // closer than this gets no louder

class SourceField {
 public:
  // `input` must outlive the field; check()ed.
  explicit SourceField(const AuralizerInput& input);

  std::size_t size() const { return input_.sources.size(); }
  std::uint32_t signal(std::size_t source) const;
  int polarity(std::size_t source) const { return input_.sources[source].polarity; }

  // Of source `source` at `place`, `distance_m` = distance_m(source, place) away.
  Bands intensity(std::size_t source, const Vec3& place, double distance_m) const;

  double distance_m(std::size_t source, const Vec3& place) const {
    return length(place - position_m(source));
  }

  // From the signal's start to a listener at that distance.
  double delay_s(std::size_t source, double distance_m) const;

  Vec3 position_m(std::size_t source) const;

  // At least sum_b weight[b] x intensity_b x d^2 anywhere, d = max(r, nearest_m(source)).
  double peak(std::size_t source, const Bands& weight) const;
  double nearest_m(std::size_t source) const;

 private:
  const AuralizerInput& input_;
  ReflectionLaws laws_;
  Bands air_loss_per_m_;
  double speed_of_sound_mps_;
};

}  // namespace clamor
