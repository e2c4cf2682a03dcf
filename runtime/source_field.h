// source_field.h: the sources of a bake, and what each gives at a place (received_intensity.h).
//
// A weighted sum of a source's bands has a ceiling that costs a tenth of the sum; the sampler
// rejects almost all sources by it. With t = p (1 - cos a),
//
//   sum_b weight_b I_b <= (diffuse cos o + lobe / (1 + t / 16)^16) / max(r, source radius)^2,
//
// because cos^p a <= exp(-t) <= (1 + t / 16)^-16, and the air only takes.
//
// Immutable once made; any thread may ask.
#pragma once

#include <cstdint>

#include "common/bands.h"
#include "common/reflection.h"
#include "common/vec.h"
#include "runtime/auralizer_input.h"
#include "runtime/received_intensity.h"

namespace clamor {

class SourceField {
 public:
  // `input` must outlive the field; check()ed.
  explicit SourceField(const AuralizerInput& input);

  std::size_t size() const { return input_.sources.size(); }
  std::uint32_t signal(std::size_t source) const {
    return input_.emitters[input_.sources[source].emitter].signal;
  }
  int polarity(std::size_t source) const { return input_.sources[source].polarity; }

  // Intensity, not amplitude: the keyframe maker takes the root.
  Bands intensity(std::size_t source, const Vec3& place) const {
    return received_intensity(input_.sources[source], input_.emitters, laws_, air_loss_per_m_,
                              place);
  }

  Vec3 position_m(std::size_t source) const {
    return source_position_m(input_.sources[source], input_.emitters);
  }
  double radius_m(std::size_t source) const { return source_radius_m(input_.sources[source]); }

  // From the signal's start to a listener at `place`.
  double delay_s(std::size_t source, const Vec3& place) const {
    const Source& s = input_.sources[source];
    const double travelled_s = s.is_emitter ? 0 : s.delay_s;
    return input_.emitters[s.emitter].delay_s + travelled_s +
           length(place - position_m(source)) / speed_of_sound_mps_;
  }

  struct Ceiling {
    float diffuse = 0, lobe = 0, exponent = 0;
    float highest() const { return diffuse + lobe; }
  };
  Ceiling ceiling(std::size_t source, const Bands& weight) const;
  double ceiling_at(std::size_t source, const Ceiling& ceiling, const Vec3& place) const;

 private:
  const AuralizerInput& input_;
  ReflectionLaws laws_;
  Bands air_loss_per_m_;
  double speed_of_sound_mps_;
};

}  // namespace clamor
