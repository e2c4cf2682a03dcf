#include "runtime/propagation/radiation_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "common/directivity.h"
#include "runtime/propagation/tolerances.h"

namespace clamor {

RadiationModel::RadiationModel(const std::vector<Emitter>& emitters,
                               std::span<const Material> materials, const Air& air,
                               const LateBoost& late_boost)
    : emitters_(emitters),
      laws_(materials),
      late_boost_(late_boost),
      air_loss_per_m_(clamor::air_loss_per_m(air)),
      speed_of_sound_mps_(clamor::speed_of_sound_mps(air)) {
  radiation_.emitters = emitters;
  for (std::size_t b = 0; b < kBandCount; ++b)
    radiation_.air_log2_loss_per_m[b] = air_loss_per_m_[b] * std::numbers::log2e_v<float>;
  // Materials with equal BRDFs share a table, which improves cache use.
  std::map<std::array<Bands, 2>, std::uint32_t> known;  // scattering and exponents
  for (std::size_t m = 0; m < materials.size(); ++m) {
    std::array<Bands, 2> law{};
    for (std::size_t b = 0; b < kBandCount; ++b) {
      law[0][b] = laws_.scattering(m, b);
      if (const PhongLobe* const lobe = laws_.lobe(m, b))
        law[1][b] = static_cast<float>(lobe->exponent());
    }
    const auto next = static_cast<std::uint32_t>(radiation_.laws.size());
    const auto [same, is_new] = known.try_emplace(law, next);
    if (is_new) radiation_.laws.push_back(reflection_table(laws_, m));
    radiation_.law_of.push_back(same->second);
  }
  timings_.reserve(emitters.size());
  for (const Emitter& emitter : emitters) {
    timings_.push_back({emitter.delay_s, emitter.signal});
    const bool first = &emitter == emitters.data();
    earliest_start_s_ = first ? emitter.delay_s : std::min(earliest_start_s_, emitter.delay_s);
    latest_start_s_ = first ? emitter.delay_s : std::max(latest_start_s_, emitter.delay_s);
  }
}

RadiationModel::UpperBound RadiationModel::upper_bound(const Source& s, const Bands& weight) const {
  Bands diffuse{}, compensation{}, lobe{};
  float slope = 0, fall = 0;
  if (s.is_emitter) {
    const Bands& directivity = emitters_[s.emitter].directivity;
    for (std::size_t b = 0; b < kBandCount; ++b)
      lobe[b] = weight[b] * s.power[b] / static_cast<float>(emission_power(directivity[b]));
    fall = *std::min_element(directivity.begin(), directivity.end()) / 2;
  } else {
    const auto law = laws_.upper_bound(s.material, dot(Vec3(s.mirror), Vec3(s.normal)));
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const float power = weight[b] * s.power[b];
      diffuse[b] = power * law.diffuse[b];
      compensation[b] = power * law.compensation[b];
      lobe[b] = power * law.lobe[b];
    }
    slope = law.slope;
    fall = law.exponent;
  }
  Bands parts{};  // maximum of each band's share over the sums below
  const auto sum_of = [&](const Bands& bands) {
    float sum = 0;
    for (const float band : bands) sum += band;
    if (sum == 0) return sum;
    const float over_sum = 1 / sum;
    const bool known = std::isnormal(sum) && std::isnormal(over_sum);
    for (std::size_t b = 0; b < kBandCount; ++b)
      parts[b] = known ? std::max(parts[b], bands[b] * over_sum) : 1;
    return sum * static_cast<float>(kFloatSlack);
  };
  return {sum_of(diffuse),         sum_of(compensation), slope, sum_of(lobe), fall,
          BandMix::at_least(parts)};
}

Bands RadiationModel::max_intensity(const Source& s) const {
  Bands most{};
  if (s.is_emitter) {
    const Bands& directivity = emitters_[s.emitter].directivity;
    for (std::size_t b = 0; b < kBandCount; ++b)
      most[b] = static_cast<float>(s.power[b] / emission_power(directivity[b]));
  } else {
    const auto law = laws_.upper_bound(s.material, dot(Vec3(s.mirror), Vec3(s.normal)));
    for (std::size_t b = 0; b < kBandCount; ++b)
      most[b] = s.power[b] * (law.diffuse[b] + law.compensation[b] + law.lobe[b]);
  }
  return most;
}

Bands RadiationModel::max_weight_per_power(std::span<const Bands> weights) const {
  Bands most{};
  const auto consider = [&](const Bands& weight, const Bands& density) {
    for (std::size_t b = 0; b < kBandCount; ++b)
      most[b] = std::max(most[b], weight[b] * density[b]);
  };
  for (const Bands& weight : weights)
    for (std::size_t m = 0; m < material_count(); ++m) consider(weight, laws_.peak_density(m));
  for (const Emitter& emitter : emitters_) {
    if (emitter.signal >= weights.size()) continue;  // a kind of moving sources, in a slot
    Bands density{};                                 // (p + 1) / 4 pi, on the axis
    for (std::size_t b = 0; b < kBandCount; ++b)
      density[b] = static_cast<float>((emitter.directivity[b] + 1.0) / (4 * std::numbers::pi));
    consider(weights[emitter.signal], density);
  }
  return most;
}

}  // namespace clamor
