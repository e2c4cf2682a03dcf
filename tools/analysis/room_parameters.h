// room_parameters.h: the room-acoustic parameters of ISO 3382-1, per octave band.
//
// They come from the energy response, which is exact and free of interference, or from a waveform,
// as a measurement would find them. All times count from the direct sound: the first arrival of a
// response; in a waveform, the first sample within 20 dB of its highest peak.
//
//   EDT, T20, T30   decay times from the lines through 0 ... -10, -5 ... -25 and -5 ... -35 dB
//   C80             energy of the first 80 ms over that of the rest, in dB
//   D50             energy of the first 50 ms over the whole
//   Ts              centre time, the mean time of arrival weighted by energy
//   G               energy re that of the same power, omnidirectional, in a free field at 10 m, dB
//
// G is relative to the emitter's radiated power, as the standard demands (it averages the free
// field over all directions), and without air absorption over those 10 m.
//
// A parameter is missing if the response is too short (see DecayCurve), EDT also if the direct
// sound makes up most of its first 10 dB, and C80 if nothing arrives late. In a waveform a decay
// time is also missing below 8 / bandwidth seconds (63 Hz: 0.18 s), close to what the octave filter
// makes of a single pulse, 3 to 6 / bandwidth. C80 and D50 are windowed before they are filtered,
// so ringing carries no energy across 50 or 80 ms.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "common/bands.h"
#include "common/decay_curve.h"
#include "formats/level/emitter.h"
#include "runtime/response/energy_response.h"
#include "tools/analysis/json_values.h"

namespace clamor {

struct RoomParameters {
  using Value = std::array<std::optional<double>, kBandCount>;
  Value edt_s, t20_s, t30_s, c80_db, d50, ts_s, g_db;
};

// How a parameter is named, printed and judged. Its just-noticeable difference (ISO 3382-1, annex
// A) is a share of the value, or an absolute one.
struct ParameterKind {
  const char* key;   // in JSON
  const char* name;  // "T30"
  const char* unit;  // "s", or ""
  RoomParameters::Value RoomParameters::*value;
  int digits;  // after the point
  double noticeable;
  bool is_share;

  // The just-noticeable difference at a value.
  double noticeable_at(double x) const { return is_share ? noticeable * x : noticeable; }
};
inline constexpr std::array<ParameterKind, 7> kParameterKinds = {{
    {"edt_s", "EDT", "s", &RoomParameters::edt_s, 3, 0.05, true},
    {"t20_s", "T20", "s", &RoomParameters::t20_s, 3, 0.05, true},
    {"t30_s", "T30", "s", &RoomParameters::t30_s, 3, 0.05, true},
    {"c80_db", "C80", "dB", &RoomParameters::c80_db, 2, 1, false},
    {"d50", "D50", "", &RoomParameters::d50, 3, 0.05, false},
    {"ts_s", "Ts", "s", &RoomParameters::ts_s, 4, 0.01, false},
    {"g_db", "G", "dB", &RoomParameters::g_db, 2, 1, false},
}};

// The kind of that name, which must exist.
const ParameterKind& kind_of(std::string_view name);

// Lists per octave by the keys of all kinds; null for what is missing.
void to_json(OrderedJson& json, const RoomParameters& parameters);

// Energy of an impulse from an omnidirectional emitter of the same power, at 10 m in a free field.
Bands free_field_energy_at_10m(const Emitter& emitter);

// The decay of one octave, from the direct sound on; none if nothing arrives in it.
std::optional<DecayCurve> energy_decay(std::span<const Arrival> arrivals, std::size_t band);

// Arrivals must be sorted by time; without any, all parameters are missing.
RoomParameters room_parameters(std::span<const Arrival> arrivals, const Bands& energy_at_10m);

// The first sample of a waveform within 20 dB of its highest; its end if it is silent.
std::size_t direct_sound(std::span<const float> waveform);

// The decay of a waveform's octave (octave_filter.h) from the direct sound on, which comes after as
// many of `frames` samples.
DecayCurve octave_decay(std::span<const double> octave, std::size_t direct, std::size_t frames);

// The waveform is at kSampleRate_hz; an impulse of amplitude 1 is one sample of 1. Costs about 0.3
// s per second.
RoomParameters room_parameters(std::span<const float> waveform, const Bands& energy_at_10m);

}  // namespace clamor
