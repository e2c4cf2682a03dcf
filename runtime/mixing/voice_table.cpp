#include "runtime/mixing/voice_table.h"

#include <algorithm>

#include "common/directivity.h"
#include "common/sample_rate.h"

namespace clamor {

VoiceTable::VoiceTable(const RadiationModel& field, std::size_t slots)
    : air_log2_loss_per_m(field.air_log2_loss_per_m()),
      frames_per_m(kSampleRate_hz / field.speed_of_sound_mps()),
      field_(field) {
  const std::size_t lanes = (slots + kTile - 1) / kTile * kTile;
  moves.resize(lanes / kTile);
  for (auto* columns : {&position_m, &normal, &mirror, &from, &mach})
    for (Column& column : *columns) column.resize(lanes);
  for (auto* columns : {&distance_m, &spread, &cos_o, &loss_cell, &log_base})
    for (Column& column : *columns) column.resize(lanes);
  for (auto* column : {&radius_m, &over_cos_i, &lift, &sign, &scale}) column->resize(lanes);
  for (auto& column : delay_frames) column.resize(lanes);
  emission_frames.resize(lanes);
  for (auto* rows : {&power, &bounce, &visibility}) rows->resize(lanes);
  kind.resize(lanes);
  exponent.resize(lanes);
  law.resize(lanes);
}

double VoiceTable::emission_frames_of(const Source& source) const {
  return field_.emission_time_s(source) * kSampleRate_hz;
}

void VoiceTable::put(std::size_t slot, const Source& source) {
  for (int axis = 0; axis < 3; ++axis) {
    position_m[axis][slot] = source.position_m[axis];
    normal[axis][slot] = source.normal[axis];
    mirror[axis][slot] = source.is_emitter ? source.normal[axis] : source.mirror[axis];
  }
  radius_m[slot] = static_cast<float>(source_radius_m(source));
  emission_frames[slot] = emission_frames_of(source);
  sign[slot] = source.polarity;
  lift[slot] = source.is_emitter ? 0.5f : 0;
  power[slot] = source.power;
  if (source.is_emitter) {
    const Bands& directivity = field_.directivity(source);
    kind[slot] = kAllRound;
    for (std::size_t b = 0; b < kBandCount; ++b) {
      const auto p = static_cast<double>(directivity[b]);
      power[slot][b] = static_cast<float>(static_cast<double>(source.power[b]) / emission_power(p));
      if (p != 0) kind[slot] = kEmitter;
    }
    exponent[slot] = directivity.data();
    return;
  }
  law[slot] = &field_.rows(source.material);
  kind[slot] = law[slot]->loss.empty() ? kDiffuse : kReflection;
  if (kind[slot] == kDiffuse) return;
  const double cos_i = dot(Vec3(source.mirror), Vec3(source.normal));
  exponent[slot] = law[slot]->exponent.data();
  over_cos_i[slot] = static_cast<float>(1 / std::max(cos_i, 1e-9));
  for (std::size_t b = 0; b < kBandCount; ++b) {
    const PhongLobe* const lobe = field_.laws().lobe(source.material, b);
    bounce[slot][b] = lobe == nullptr ? 0
                                      : law[slot]->compensation[b] * source.power[b] *
                                            static_cast<float>(1 - lobe->albedo(cos_i));
  }
}

void VoiceTable::set_velocity(std::size_t slot, const Vec3f& velocity_mps) {
  const Vec3f now = velocity_mps / static_cast<float>(field_.speed_of_sound_mps());
  if (now == mach_of(slot)) return;
  for (int axis = 0; axis < 3; ++axis) mach[axis][slot] = now[axis];
  const std::size_t tile = slot / kTile;
  moves[tile] = false;
  for (std::size_t s = tile * kTile; s < (tile + 1) * kTile; ++s)
    moves[tile] = moves[tile] || mach_of(s) != Vec3f(0);
}

void VoiceTable::move(std::size_t slot, const Vec3f& by_m) {
  for (int axis = 0; axis < 3; ++axis) position_m[axis][slot] += by_m[axis];
}

}  // namespace clamor
