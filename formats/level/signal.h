// signal.h: a sound that emitters play.
#pragma once

#include <string>
#include <vector>

namespace clamor {

// Mono, at kSampleRate_hz, with a full scale of 1.
struct Signal {
  std::string name;
  std::vector<float> samples;
  bool loop = true;  // otherwise played once, from time 0 of the emitter

  bool operator==(const Signal&) const = default;
};

}  // namespace clamor
