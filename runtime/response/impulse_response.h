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

// Limits of a whole response and of the silence at its beginning.
inline constexpr double kMaxResponse_s = 60, kMaxSilence_s = 10;

// The frame at which a response begins: that of the emission, or of the first arrival where the
// sound travels for longer than kMaxSilence_s.
std::size_t first_response_frame(std::span<const Arrival> arrivals);

// Length at kSampleRate_hz, from first_response_frame() on, that holds all arrivals and their
// ringing; at most kMaxResponse_s.
std::size_t whole_response_frames(std::span<const Arrival> arrivals);

// Overwrites `response` with the samples from frame `first` after emission on. An emitter of gain 1
// at 1 m on its axis gives one sample of 1. Costs 0.3 us per arrival and, from the first to the
// last one, 1 s per 10 s and 86 bytes per frame.
void write_impulse_response(std::span<const Arrival> arrivals, std::size_t first,
                            std::span<float> response);

// Returns `frames` of these samples.
std::vector<float> impulse_response(std::span<const Arrival> arrivals, std::size_t frames,
                                    std::size_t first = 0);

}  // namespace clamor
