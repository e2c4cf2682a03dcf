#include "runtime/measures/sampled_response.h"

#include <algorithm>

#include "runtime/field/loudness.h"
#include "runtime/sounds/signal_bank.h"

namespace clamor {

std::vector<Arrival> arrivals_of(std::span<const SampledSource> sample, const SourceField& field,
                                 const std::vector<Emitter>& emitters, const Vec3& listener_m) {
  std::vector<Arrival> arrivals;
  arrivals.reserve(sample.size());
  for (const SampledSource& chosen : sample) {
    const Source& source = *chosen.source;
    Arrival arrival;
    arrival.time_s = field.delay_s(source, listener_m) - emitters[source.emitter].delay_s;
    arrival.energy = field.intensity(source, listener_m);
    for (float& band : arrival.energy) band *= static_cast<float>(chosen.power_scale);
    arrival.polarity = source.is_emitter ? 1 : source.polarity;
    arrivals.push_back(arrival);
  }
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const Arrival& a, const Arrival& b) { return a.time_s < b.time_s; });
  return arrivals;
}

std::vector<Arrival> sampled_response(const StrategyOptions& options,
                                      std::span<const Source> sources,
                                      const std::vector<Emitter>& emitters,
                                      std::span<const Material> materials, const Air& air,
                                      const Vec3& listener_m, std::uint32_t emitter,
                                      const LateBoost& late_boost) {
  if (options.strategy == "all")
    return energy_response(sources, emitters, materials, air, listener_m, emitter);
  std::vector<Source> of_emitter;
  for (const Source& source : sources)
    if (source.emitter == emitter) of_emitter.push_back(source);
  std::vector<Emitter> playing = emitters;
  for (Emitter& one : playing) one.signal = 0;
  const SourceField field(playing, materials, air, late_boost);
  const std::vector<Signal> impulse = {{"impulse", {1}, false}};
  Bands weight = loudness_weights();
  const Bands power = prepare_signals(impulse)[0].mean_square();
  for (std::size_t b = 0; b < kBandCount; ++b) weight[b] *= power[b];
  const SignalWeights weights{{weight}};
  SourceList list(field, weights, std::move(of_emitter));
  const auto sampler = make_sampler(options, field, weights, list);
  std::vector<Arrival> arrivals =
      arrivals_of(sampler->sample(listener_m), field, playing, listener_m);
  std::erase_if(arrivals, [](const Arrival& arrival) { return arrival.energy == Bands{}; });
  return arrivals;
}

}  // namespace clamor
