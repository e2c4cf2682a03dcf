// emitter_spec.h: an emitter as a person writes it, on the command line or in a sidecar.
//
//   name=violin,signal=violin.flac,at=1,1.2,-3,facing=0,0,1,gain=0dB,directivity=2
//
// A comma begins a new field when a name and = follow it, and belongs to the value otherwise.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/bands.h"
#include "common/result.h"
#include "common/vec.h"

namespace clamor {

struct EmitterSpec {
  std::string name;    // empty: to be named after its signal
  std::string signal;  // a file, or "impulse" or "noise"
  Vec3 at_m{};
  Vec3 facing{0, 0, -1};  // unit
  double gain = 1;
  Bands directivity{};
  double delay_s = 0;
  double random_delay_s = 0;  // a start delay drawn from [0, this), as a crowd needs
  std::optional<bool> loop;   // default yes, but an impulse no
};

inline constexpr double kMaxEmitterCoordinate_m = 1e6;
inline constexpr double kMaxDelay_s = 3600;
inline constexpr double kMaxGain = 1e4;  // 80 dB
inline constexpr double kMaxDirectivity = 1000;

// "0dB", "-6.5 dB", in any case, or a factor such as "x0.5"; up to `greatest`. A number alone could
// be either and is refused.
Result<double> parse_gain(std::string_view text, double greatest = kMaxGain);

// Needs `signal` and `at`. Errors show an example to copy.
Result<EmitterSpec> parse_emitter(std::string_view text);

}  // namespace clamor
