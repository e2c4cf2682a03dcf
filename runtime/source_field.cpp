#include "runtime/source_field.h"

#include <algorithm>
#include <string>

#include "common/air.h"

namespace clamor {

SourceField::SourceField(const AuralizerInput& input)
    : input_(input),
      laws_(input.materials),
      air_loss_per_m_(air_loss_per_m(input.air)),
      speed_of_sound_mps_(speed_of_sound_mps(input.air)) {}

SourceField::Ceiling SourceField::ceiling(std::size_t source, const Bands& weight) const {
  const Source& s = input_.sources[source];
  double diffuse = 0, lobe = 0;
  float exponent = 0;
  if (s.is_emitter) {
    const double gain = input_.emitters[s.emitter].gain;
    for (const float w : weight) lobe += w * gain * gain;
  } else {
    const auto law = laws_.ceiling(s.material, dot(Vec3(s.mirror), Vec3(s.normal)));
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const double power = static_cast<double>(weight[b]) * s.power[b];
      diffuse += power * law.diffuse[b];
      lobe += power * law.lobe[b];
    }
    exponent = law.exponent;
  }
  // Rounding must never make a ceiling too low.
  constexpr double kSlack = 1.00001;
  return {static_cast<float>(diffuse * kSlack), static_cast<float>(lobe * kSlack), exponent};
}

double SourceField::ceiling_at(std::size_t source, const Ceiling& ceiling,
                               const Vec3& place) const {
  const Source& s = input_.sources[source];
  const Vec3 path_m = place - position_m(source);
  const double r_m = length(path_m), clamped_m = std::max(r_m, source_radius_m(s));
  if (s.is_emitter || r_m == 0) return ceiling.highest() / (clamped_m * clamped_m);
  const double cos_o = dot(path_m, Vec3(s.normal)) / r_m;
  if (cos_o <= 0) return 0;
  const double t = ceiling.exponent * (1 - std::min(dot(path_m, Vec3(s.mirror)) / r_m, 1.0));
  double fall = 1 + t / 16;
  for (int squared = 0; squared < 4; ++squared) fall *= fall;
  return (ceiling.diffuse * cos_o + ceiling.lobe / fall) / (clamped_m * clamped_m);
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
