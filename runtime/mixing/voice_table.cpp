#include "runtime/mixing/voice_table.h"

#include <algorithm>

#include "common/directivity.h"
#include "common/sample_rate.h"

namespace clamor {

VoiceTable::VoiceTable(const RadiationModel& radiation_model, std::size_t slots)
    : radiation_model_(radiation_model) {
  geometry.frames_per_m = kSampleRate_hz / radiation_model.speed_of_sound_mps();
  radiation.air_log2_loss_per_m = radiation_model.air_log2_loss_per_m();
  resize(slots);
}

void VoiceTable::resize(std::size_t slots) {
  const std::size_t rows = (slots + kTile - 1) / kTile * kTile;
  const auto each = [rows](auto&... columns) { (columns.resize(rows), ...); };
  const auto resize_each = [&](auto&... arrays) {
    (std::ranges::for_each(arrays, [&](auto& column) { column.resize(rows); }), ...);
  };
  resize_each(geometry.position_m, geometry.normal, geometry.mirror, geometry.mach);
  each(geometry.radius_m, geometry.lift, geometry.emission_frames);
  geometry.moves.resize(rows / kTile);
  geometry.changed.resize(rows / kTile);
  each(radiation.kind, radiation.power, radiation.compensation, radiation.inverse_cos_i,
       radiation.exponent, radiation.law, radiation.sign, radiation.scale, radiation.power_gain);
  resize_each(arrivals.delay_frames, arrivals.last_delay_frames, arrivals.distance_m,
              arrivals.spread, arrivals.cos_o, arrivals.loss_cell, arrivals.log_base,
              arrivals.from);
}

double VoiceTable::emission_frames_of(const Source& source, double start_s) const {
  return (start_s + radiation_model_.emission_time_s(source)) * kSampleRate_hz;
}

void VoiceTable::put(std::size_t slot, const Source& source, double start_s) {
  for (int axis = 0; axis < 3; ++axis) {
    geometry.position_m[axis][slot] = source.position_m[axis];
    geometry.normal[axis][slot] = source.normal[axis];
    geometry.mirror[axis][slot] = source.axis()[axis];
  }
  geometry.radius_m[slot] = static_cast<float>(source_radius_m(source));
  geometry.emission_frames[slot] = emission_frames_of(source, start_s);
  geometry.lift[slot] = source.is_emitter ? 0.5f : 0;
  geometry.changed[slot / kTile] = true;

  VoiceRadiation::Kind& kind = radiation.kind[slot];
  Bands& power = radiation.power[slot];
  radiation.sign[slot] = source.polarity;
  power = source.power;
  if (source.is_emitter) {
    const Bands& directivity = radiation_model_.directivity(source);
    kind = VoiceRadiation::kOmnidirectional;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const auto p = static_cast<double>(directivity[b]);
      power[b] = static_cast<float>(static_cast<double>(source.power[b]) / emission_power(p));
      if (p != 0) kind = VoiceRadiation::kEmitter;
    }
    radiation.exponent[slot] = directivity.data();
    return;
  }
  const ReflectionTable& law = radiation_model_.rows(source.material);
  radiation.law[slot] = &law;
  kind = law.loss.empty() ? VoiceRadiation::kDiffuse : VoiceRadiation::kReflection;
  if (kind == VoiceRadiation::kDiffuse) return;
  const double cos_i = dot(Vec3(source.mirror), Vec3(source.normal));
  radiation.exponent[slot] = law.exponent.data();
  radiation.inverse_cos_i[slot] = static_cast<float>(1 / std::max(cos_i, 1e-9));
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const PhongLobe* const lobe = radiation_model_.laws().lobe(source.material, b);
    radiation.compensation[slot][b] =
        lobe == nullptr
            ? 0
            : law.compensation[b] * source.power[b] * static_cast<float>(1 - lobe->albedo(cos_i));
  }
}

void VoiceTable::set_velocity(std::size_t slot, const Vec3f& velocity_mps) {
  const Vec3f now = velocity_mps / static_cast<float>(radiation_model_.speed_of_sound_mps());
  if (now == mach_of(slot)) return;
  for (int axis = 0; axis < 3; ++axis) geometry.mach[axis][slot] = now[axis];
  const std::size_t tile = slot / kTile;
  bool moves = false;
  for (std::size_t s = tile * kTile; s < (tile + 1) * kTile; ++s)
    moves = moves || mach_of(s) != Vec3f(0);
  geometry.moves[tile] = moves;
}

void VoiceTable::move(std::size_t slot, const Vec3f& by_m) {
  for (int axis = 0; axis < 3; ++axis) geometry.position_m[axis][slot] += by_m[axis];
  geometry.changed[slot / kTile] = true;
}

}  // namespace clamor
