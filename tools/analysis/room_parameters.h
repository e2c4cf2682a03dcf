// room_parameters.h: the room-acoustic parameters of ISO 3382-1, per octave band.
//
// They come from the energy response, which is exact and carries no chance of phase, or from a
// waveform, as a measurement would find them. All times count from the direct sound: the first
// arrival of a response; in a waveform, the first sample within 20 dB of its highest peak.
//
//   EDT, T20, T30   decay times from the lines through 0 ... -10, -5 ... -25 and -5 ... -35 dB
//   C80             energy of the first 80 ms over that of the rest, in dB
//   D50             energy of the first 50 ms over the whole
//   Ts              centre time, the mean time of arrival weighed by energy
//   G               energy re that of the same power, omnidirectional, in a free field at 10 m, dB
//
// G is re the emitter's radiated power, as the standard asks (it averages the free field over all
// directions), and without the air's loss over those 10 m.
//
// A parameter is left out where the response is too short to tell (DecayCurve says when), EDT also
// where the direct sound makes most of its first 10 dB, and C80 where nothing comes late. In a
// waveform a decay time is also left out below 8 / bandwidth seconds (63 Hz: 0.18 s), near what the
// octave filter makes of a mere pulse, 3 to 6 / bandwidth. C80 and D50 are windowed before they are
// filtered, so its ringing carries nothing across 50 or 80 ms.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "common/bands.h"
#include "formats/level/emitter.h"
#include "tools/analysis/energy_response.h"

namespace clamor {

struct RoomParameters {
  using Value = std::array<std::optional<double>, kBandCount>;
  Value edt_s, t20_s, t30_s, c80_db, d50, ts_s, g_db;
};

// Energy of an impulse from an omnidirectional emitter of the same power, at 10 m in a free field.
Bands free_field_energy_at_10m(const Emitter& emitter);

// Arrivals by ascending time; without any, nothing is known.
RoomParameters room_parameters(std::span<const Arrival> arrivals, const Bands& energy_at_10m);

// A waveform at kSampleRate_hz in which an impulse of amplitude 1 is one sample of 1. Costs about
// 0.3 s per second of it.
RoomParameters room_parameters(std::span<const float> waveform, const Bands& energy_at_10m);

}  // namespace clamor
