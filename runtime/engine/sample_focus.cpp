#include "runtime/engine/sample_focus.h"

#include <algorithm>

namespace clamor {

SoundPart SampleFocus::part_of(const SampledSource& chosen, const Listener& listener) const {
  const Source& source = *chosen.source;
  if (source.is_emitter) return SoundPart::kDirect;
  const double path_m = length(listener.position_m - Vec3(source.position_m));
  const double direct_m = length(listener.position_m - emitters_[source.emitter].position_m);
  const double behind_s =
      static_cast<double>(source.delay_s) + (path_m - direct_m) / radiation_.speed_of_sound_mps();
  return behind_s <= kEarly_s ? SoundPart::kEarly : SoundPart::kLate;
}

std::span<const SampledSource> SampleFocus::apply(std::span<const SampledSource> sample,
                                                  const Listener& listener) {
  if (focus_.is_neutral()) return sample;
  scaled_.assign(sample.begin(), sample.end());
  for (SampledSource& chosen : scaled_) {
    const float part = focus_.parts[static_cast<std::size_t>(part_of(chosen, listener))];
    for (std::size_t b = 0; b < kBandCount; ++b)
      chosen.factors.occlusion[b] *= part * focus_.bands[b];
  }
  return scaled_;
}

void SampleFocus::describe(std::span<const SampledSource> sample, const Listener& listener,
                           std::vector<HeardSource>& heard) const {
  heard.clear();
  for (const SampledSource& chosen : sample) {
    const Source& source = *chosen.source;
    const Bands intensity = radiation_.intensity(source, listener.position_m);
    const SoundPart part = part_of(chosen, listener);
    const Bands gain = power_gain(chosen.factors);
    double power = 0;
    for (std::size_t b = 0; b < kBandCount; ++b)
      power += static_cast<double>(intensity[b] * gain[b] * focus_.bands[b]);
    power *= chosen.power_scale * static_cast<double>(focus_.parts[static_cast<std::size_t>(part)]);
    heard.push_back({chosen.number, source.position_m, static_cast<float>(power),
                     *std::ranges::max_element(gain), source.emitter, part});
  }
}

}  // namespace clamor
