// impulse_response.h: synthesises the waveform of an impulse response from its arrivals.
//
// Each arrival becomes a pulse with its polarity and the amplitude sqrt(energy_b) in band b, which
// is where energy becomes amplitude. Pulses are placed at exact times by a windowed sinc (32 taps;
// flat within 0.1 dB to 18 kHz), in one signal per band. The bands are filtered with the mixer's
// band split at zero phase and added (octave_filter.h), so an arrival with equal bands is one clean
// pulse.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "runtime/response/energy_response.h"

namespace clamor {

// Length at kSampleRate_hz that holds all arrivals and their ringing.
std::size_t whole_response_frames(std::span<const Arrival> arrivals);

// The first `frames` samples after emission. An emitter of gain 1 at 1 m on its axis gives one
// sample of 1. Costs 0.3 us per arrival, 1 s per 10 s of response, and 64 bytes per frame.
std::vector<float> impulse_response(std::span<const Arrival> arrivals, std::size_t frames);

}  // namespace clamor
