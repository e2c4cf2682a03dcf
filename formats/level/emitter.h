// emitter.h: a point that emits a signal.
#pragma once

#include <cstdint>
#include <string>

#include "common/bands.h"
#include "common/vec.h"

namespace clamor {

// At 1 m on its axis an emitter is heard with amplitude gain x signal.
struct Emitter {
  std::string name;
  Vec3 position_m{};
  Vec3 axis{0, 0, -1};  // unit; 0 degrees of the directivity
  double gain = 1;      // amplitude at 1 m on the axis
  Bands directivity{};  // exponent p of ((1 + cos a) / 2)^p per band, 0 = omnidirectional
  std::uint32_t signal = 0;
  double delay_s = 0;  // start of the signal after time 0; a phase if it loops

  bool operator==(const Emitter&) const = default;
};

}  // namespace clamor
