#include "tools/analysis/room_parameters.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/directivity.h"
#include "common/sample_rate.h"
#include "runtime/response/octave_filter.h"

namespace clamor {

namespace {

constexpr double kClarity_s = 0.080, kDefinition_s = 0.050;
constexpr double kMinWidthTimesDecay = 8;  // a pulse shows 3 to 6

void set_decay_times(RoomParameters& parameters, std::size_t b, const DecayCurve& curve,
                     double shortest_s) {
  const auto unless_too_short = [&](const std::optional<double>& time_s) {
    return time_s && *time_s >= shortest_s ? time_s : std::nullopt;
  };
  parameters.edt_s[b] = unless_too_short(curve.early_decay_time_s());
  parameters.t20_s[b] = unless_too_short(curve.decay_time_s(-5, -25));
  parameters.t30_s[b] = unless_too_short(curve.decay_time_s(-5, -35));
}

std::optional<double> decibels(double ratio) {
  if (!(ratio > 0) || !std::isfinite(ratio)) return std::nullopt;
  return 10 * std::log10(ratio);
}

double energy_of(std::span<const double> signal) {
  double sum = 0;
  for (const double x : signal) sum += x * x;
  return sum;
}

// Energies of the first `early` samples of a signal, and of the rest, in one octave.
struct EarlyAndLate {
  double early, late;
};
EarlyAndLate split(std::span<const double> signal, std::size_t early, std::size_t band,
                   std::vector<double> octave) {
  const std::vector<double> early_octave =
      octave_of(signal.first(std::min(early, signal.size())), band);
  for (std::size_t i = 0; i < early_octave.size(); ++i) octave[i] -= early_octave[i];
  return {energy_of(early_octave), energy_of(octave)};
}

std::size_t samples(double seconds) {
  return static_cast<std::size_t>(std::lround(seconds * kSampleRate_hz));
}

// Time of a sample of an octave after the direct sound.
double octave_time_s(std::size_t i, std::size_t direct) {
  return (static_cast<double>(i) - static_cast<double>(kOctaveRing + direct)) / kSampleRate_hz;
}

}  // namespace

const ParameterKind& kind_of(std::string_view name) {
  return *std::ranges::find(kParameterKinds, name, &ParameterKind::name);
}

void to_json(OrderedJson& json, const RoomParameters& parameters) {
  for (const ParameterKind& kind : kParameterKinds) {
    auto& values = json[kind.key] = OrderedJson::array();
    for (const auto& value : parameters.*kind.value)
      values.push_back(value ? OrderedJson(*value) : OrderedJson());
  }
}

Bands free_field_energy_at_10m(const Emitter& emitter) {
  Bands energy{};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const double power = emitter.gain * emitter.gain * emission_power(emitter.directivity[b]);
    energy[b] = static_cast<float>(power / (emission_power(0) * 10 * 10));
  }
  return energy;
}

std::optional<DecayCurve> energy_decay(std::span<const Arrival> arrivals, std::size_t band) {
  std::vector<EnergyStep> steps;
  for (const Arrival& arrival : arrivals)
    if (arrival.energy[band] > 0)
      steps.push_back({arrival.time_s - arrivals.front().time_s, arrival.energy[band]});
  if (steps.empty()) return std::nullopt;
  return DecayCurve(steps, steps.back().time_s);
}

RoomParameters room_parameters(std::span<const Arrival> arrivals, const Bands& energy_at_10m) {
  RoomParameters parameters;
  if (arrivals.empty()) return parameters;
  const double direct_s = arrivals.front().time_s;
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const auto curve = energy_decay(arrivals, b);
    if (!curve) continue;
    double clear = 0, defined = 0, late = 0, moment = 0;
    for (const Arrival& arrival : arrivals) {
      const double t_s = arrival.time_s - direct_s, energy = arrival.energy[b];
      if (energy <= 0) continue;
      (t_s < kClarity_s ? clear : late) += energy;
      if (t_s < kDefinition_s) defined += energy;
      moment += t_s * energy;
    }
    set_decay_times(parameters, b, *curve, 0);
    parameters.c80_db[b] = decibels(clear / late);
    parameters.d50[b] = defined / curve->energy();
    parameters.ts_s[b] = moment / curve->energy();
    parameters.g_db[b] = decibels(curve->energy() / energy_at_10m[b]);
  }
  return parameters;
}

std::size_t direct_sound(std::span<const float> waveform) {
  double peak = 0;
  for (const float x : waveform) peak = std::max(peak, static_cast<double>(std::abs(x)));
  if (!(peak > 0)) return waveform.size();
  const auto is_near = [&](float x) { return static_cast<double>(std::abs(x)) >= peak / 10; };
  return static_cast<std::size_t>(std::ranges::find_if(waveform, is_near) - waveform.begin());
}

DecayCurve octave_decay(std::span<const double> octave, std::size_t direct, std::size_t frames) {
  std::vector<EnergyStep> steps(octave.size());
  for (std::size_t i = 0; i < octave.size(); ++i)
    steps[i] = {octave_time_s(i, direct), octave[i] * octave[i]};
  return DecayCurve(steps, static_cast<double>(frames - direct) / kSampleRate_hz);
}

RoomParameters room_parameters(std::span<const float> waveform, const Bands& energy_at_10m) {
  RoomParameters parameters;
  const std::vector<double> signal(waveform.begin(), waveform.end());
  const std::size_t direct = direct_sound(waveform);
  if (direct == waveform.size()) return parameters;
  const std::vector<double> impulse = {1};
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const std::vector<double> octave = octave_of(signal, b);
    const DecayCurve curve = octave_decay(octave, direct, signal.size());
    if (!(curve.energy() > 0)) continue;
    set_decay_times(parameters, b, curve, kMinWidthTimesDecay / octave_width_hz(b));
    double moment = 0;
    for (std::size_t i = 0; i < octave.size(); ++i)
      moment += octave_time_s(i, direct) * (octave[i] * octave[i]);

    const EarlyAndLate clarity = split(signal, direct + samples(kClarity_s), b, octave);
    const EarlyAndLate definition = split(signal, direct + samples(kDefinition_s), b, octave);
    parameters.c80_db[b] = decibels(clarity.early / clarity.late);
    parameters.d50[b] = definition.early / (definition.early + definition.late);
    parameters.ts_s[b] = moment / curve.energy();
    const double per_impulse = energy_of(octave_of(impulse, b));
    parameters.g_db[b] = decibels(curve.energy() / per_impulse / energy_at_10m[b]);
  }
  return parameters;
}

}  // namespace clamor
