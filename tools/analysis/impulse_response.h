// impulse_response.h: the waveform that an impulse leaves at a listener.
//
// Each arrival becomes a pulse of its polarity whose amplitude in band b is sqrt(energy_b): the
// place where energy turns into amplitude. Pulses are laid at their exact times by a windowed sinc
// (32 taps; flat within 0.1 dB to 18 kHz), into one signal per band; the bands are then filtered
// with the mixer's own split, without phase, and added (octave_filter.h). So an arrival that is
// alike in all bands is one clean pulse.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tools/analysis/energy_response.h"

namespace clamor {

// Samples at kSampleRate_hz to hold all arrivals and their ringing.
std::size_t whole_response_frames(std::span<const Arrival> arrivals);

// The first `frames` samples, from the moment the impulse leaves the emitter. An emitter of gain 1
// at 1 m on its axis gives one sample of 1. Costs 0.3 us per arrival and 1 s per 10 s of response;
// 64 bytes per frame.
std::vector<float> impulse_response(std::span<const Arrival> arrivals, std::size_t frames);

}  // namespace clamor
