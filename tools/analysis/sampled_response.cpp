#include "tools/analysis/sampled_response.h"

#include <algorithm>
#include <optional>

#include "runtime/occlusion/occlusion_batch.h"
#include "runtime/occlusion/visibility_cache.h"
#include "runtime/propagation/loudness.h"
#include "runtime/streaming/prepared_signal.h"

namespace clamor {

std::vector<Arrival> arrivals_of(std::span<const SampledSource> sample,
                                 const RadiationModel& radiation,
                                 const std::vector<Emitter>& emitters, const Vec3& listener_m) {
  std::vector<Arrival> arrivals;
  arrivals.reserve(sample.size());
  for (const SampledSource& chosen : sample) {
    const Source& source = *chosen.source;
    Arrival arrival;
    arrival.time_s = radiation.delay_s(source, listener_m) - emitters[source.emitter].delay_s;
    arrival.energy = radiation.intensity(source, listener_m);
    const Bands gain = power_gain(chosen.factors);
    for (std::size_t b = 0; b < kBandCount; ++b)
      arrival.energy[b] *= static_cast<float>(chosen.power_scale) * gain[b];
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
                                      const LateBoost& late_boost,
                                      const OcclusionGeometry* surfaces) {
  if (options.strategy == "all")
    return energy_response(sources, emitters, materials, air, listener_m, emitter, surfaces);
  const bool occludes = surfaces != nullptr && uses_occlusion(options.strategy);
  std::vector<Source> of_emitter;
  for (const Source& source : sources)
    if (source.emitter == emitter && (occludes || !source.is_image)) of_emitter.push_back(source);
  std::vector<Emitter> playing = emitters;
  for (Emitter& one : playing) one.signal = 0;
  const RadiationModel radiation(playing, materials, air, late_boost);
  const std::vector<Signal> impulse = {{"impulse", {1}, false}};
  Bands weight = loudness_weights();
  const Bands power = prepare_signals(impulse)[0].mean_square();
  for (std::size_t b = 0; b < kBandCount; ++b) weight[b] *= power[b];
  const SignalWeights weights{{weight}};
  SourceList list(radiation, weights, std::move(of_emitter));
  std::optional<VisibilityCache> occlusion;
  if (occludes)
    occlusion.emplace(*surfaces, radiation.speed_of_sound_mps(), VisibilityOptions{.exact = true});
  const auto sampler =
      make_sampler(options, radiation, weights, list, occlusion ? &*occlusion : nullptr);
  const auto chosen = sampler->sample(listener_m);
  std::vector<SampledSource> sample(chosen.begin(), chosen.end());
  if (occlusion) {
    // Occlusion is coarse for choosing, as in a player, and fine for the response, as for all
    // sources. Direct sounds around edges are fine already.
    std::vector<const Source*> looked_at;
    for (const SampledSource& one : sample) looked_at.push_back(one.source);
    const std::vector<Bands> visible =
        fine_visibility(*surfaces, radiation.speed_of_sound_mps(), looked_at, listener_m);
    for (std::size_t i = 0; i < sample.size(); ++i)
      if (!sample[i].moves) sample[i].factors.occlusion = visible[i];
  }
  std::vector<Arrival> arrivals = arrivals_of(sample, radiation, playing, listener_m);
  std::erase_if(arrivals, [](const Arrival& arrival) { return arrival.energy == Bands{}; });
  return arrivals;
}

}  // namespace clamor
