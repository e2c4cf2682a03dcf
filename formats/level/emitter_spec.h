// emitter_spec.h: parses emitters of the command line and of sidecars.
//
//   name=violin,signal=violin.flac,at=1,1.2,-3,facing=0,0,1,gain=0dB,directivity=2
//
// A comma begins a new field if a name and = follow, and otherwise belongs to the value.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/bands.h"
#include "common/result.h"
#include "common/vec.h"

namespace clamor {

struct EmitterSpec {
  std::string name;    // if empty, the emitter is named after its signal
  std::string signal;  // path of a sound file, "impulse" or "noise"
  Vec3 at_m{};
  Vec3 facing{0, 0, -1};  // unit
  double gain = 1;
  Bands directivity{};
  double delay_s = 0;
  double random_delay_s = 0;  // additional random delay in [0, this), for crowds
  std::optional<bool> loop;   // default true, except for impulses
};

// A change to the emitters of that name in the level: what is not given stays as it is.
struct EmitterChange {
  std::string name;
  bool removed = false;
  std::optional<Vec3> at_m, facing;  // facing: unit
  std::optional<double> gain, delay_s;
  std::optional<Bands> directivity;
};

inline constexpr double kMaxEmitterCoordinate_m = 1e6;  // from the level's origin
inline constexpr double kMaxDelay_s = 3600;
inline constexpr double kMaxGain = 1e4;  // 80 dB
inline constexpr double kMaxDirectivity = 1000;

// Parses decibels ("0dB", "-6.5 dB", ignoring case) or a factor ("x0.5") of at most `greatest`. A
// bare number is ambiguous and an Error.
Result<double> parse_gain(std::string_view text, double greatest = kMaxGain);

// Requires `signal` and `at`. Errors contain an example.
Result<EmitterSpec> parse_emitter(std::string_view text);

}  // namespace clamor
