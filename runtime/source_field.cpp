#include "runtime/source_field.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/air.h"
#include "common/directivity.h"

namespace clamor {

SourceField::SourceField(const AuralizerInput& input)
    : input_(input),
      laws_(input.materials),
      air_loss_per_m_(air_loss_per_m(input.air)),
      speed_of_sound_mps_(speed_of_sound_mps(input.air)) {}

std::uint32_t SourceField::signal(std::size_t source) const {
  return input_.emitters[input_.sources[source].emitter].signal;
}

Vec3 SourceField::position_m(std::size_t source) const {
  const Source& s = input_.sources[source];
  return s.is_emitter ? input_.emitters[s.emitter].position_m : Vec3(s.position_m);
}

double SourceField::nearest_m(std::size_t source) const {
  const Source& s = input_.sources[source];
  // A patch of no size is a point; one that touches the ear is no louder than an emitter would be.
  return s.is_emitter ? kNearestEmitter_m : std::max<double>(s.patch_radius_m, kNearestEmitter_m);
}

double SourceField::delay_s(std::size_t source, double distance_m) const {
  const Source& s = input_.sources[source];
  const double travelled_s = s.is_emitter ? 0 : s.delay_s;
  return input_.emitters[s.emitter].delay_s + travelled_s + distance_m / speed_of_sound_mps_;
}

Bands SourceField::intensity(std::size_t source, const Vec3& place, double distance_m) const {
  const Source& s = input_.sources[source];
  const double clamped_m = std::max(distance_m, nearest_m(source));
  const double spread = 1 / (clamped_m * clamped_m);
  // Straight above where there is no direction: loud rather than silent.
  const auto cos_to = [&](const Vec3& axis) {
    return distance_m > 0 ? dot(place - position_m(source), axis) / distance_m : 1.0;
  };

  Bands result{};
  if (s.is_emitter) {
    const Emitter& emitter = input_.emitters[s.emitter];
    const double on_axis = emitter.gain * emitter.gain * spread;
    const double cos_a = std::clamp(cos_to(emitter.axis), -1.0, 1.0);
    for (std::size_t b = 0; b < kBandCount; ++b)
      result[b] = static_cast<float>(on_axis * emission(emitter.directivity[b], cos_a));
  } else {
    const Vec3 normal(s.normal), mirror(s.mirror);
    const double cos_o = cos_to(normal);
    if (cos_o <= 0) return result;
    result = laws_.density(s.material, dot(normal, mirror), cos_o, cos_to(mirror));
    for (std::size_t b = 0; b < kBandCount; ++b)
      result[b] *= static_cast<float>(s.power[b] * spread);
  }
  const auto r = static_cast<float>(distance_m);
  for (std::size_t b = 0; b < kBandCount; ++b) result[b] *= std::exp(-air_loss_per_m_[b] * r);
  return result;
}

double SourceField::peak(std::size_t source, const Bands& weight) const {
  const Source& s = input_.sources[source];
  double sum = 0;
  if (s.is_emitter) {
    const double gain = input_.emitters[s.emitter].gain;
    for (const float w : weight) sum += w * gain * gain;
  } else {
    const Bands density = laws_.peak_density(s.material);
    for (std::size_t b = 0; b < kBandCount; ++b)
      sum += static_cast<double>(weight[b]) * s.power[b] * density[b];
  }
  return sum;
}

Result<void> check(const AuralizerInput& input) {
  if (input.sources.empty())
    return Error("there are no sources to hear; bake the level with an emitter.");
  for (const Emitter& emitter : input.emitters)
    if (emitter.signal >= input.signals.size())
      return Error("emitter " + in_quotes(emitter.name) + " plays signal " +
                   std::to_string(emitter.signal) + ", but there are " +
                   std::to_string(input.signals.size()) + ". Bake again.");
  for (const Source& source : input.sources) {
    if (source.emitter >= input.emitters.size())
      return Error("a source belongs to emitter " + std::to_string(source.emitter) +
                   ", but there are " + std::to_string(input.emitters.size()) + ". Bake again.");
    if (!source.is_emitter && source.material >= input.materials.size())
      return Error("a source is of material " + std::to_string(source.material) +
                   ", but there are " + std::to_string(input.materials.size()) + ". Bake again.");
  }
  return {};
}

}  // namespace clamor
