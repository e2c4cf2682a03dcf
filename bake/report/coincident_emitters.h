// coincident_emitters.h: finds emitters that sound alike at one place and time.
//
// The direct sound of n such emitters arrives as one waveform, so it adds up in amplitude; their
// reflections take n independent sets of paths and add up in power. With n equal ones the direct
// sound is 10 log10(n) dB too loud against the reverberation.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/vec.h"

namespace clamor {

struct Emitter;

// A sentence for each of the largest groups, with their places in the world.
std::vector<std::string> coincident_emitters(std::span<const Emitter> emitters,
                                             const Vec3& origin_m);

}  // namespace clamor
