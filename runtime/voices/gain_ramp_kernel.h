// gain_ramp_kernel.h: gains of a voice's buses, from a keyframe's to the next one's, in vectors.
//
// A keyframe of 20 000 voices has 320 000 gains, each of which is a sum over octaves: all the audio
// thread does at once. Highway is visible only in the .cpp.
#pragma once

#include <array>
#include <cstddef>

#include "common/bands.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

// What voices' gains in octaves are to be multiplied by for the buses to come out with them: by
// octave, then in the order of lanes, the same for either ear.
struct alignas(64) BusGains {
  std::array<std::array<float, kBandLanes>, kBandCount> columns{};

  using Matrix = std::array<std::array<double, kBandCount>, kBandCount>;  // [bus][octave]
  static BusGains of(const Matrix& matrix);
};

// The lanes of a voice that has such gains at its ears.
void bus_lanes(const BusGains& buses, const std::array<Bands, kEars>& gain,
               float* lanes) noexcept REALTIME;

// Straight lines from `target`, or from 0 if the voice `starts`, to `targets`, which become the
// target: first the lanes' values, then how they grow in kGainFrames of `frames`. True if any is
// heard. `lanes` is kBandLanes, kHrtfLanes or kEars.
struct GainRamps {
  float* target;         // [lanes]
  float* gain;           // [2][lanes]
  const float* targets;  // [lanes]
  std::size_t lanes;
  int frames;
  bool starts;
};
bool ramp_gains(const GainRamps& lines) noexcept REALTIME;

// One of the directions between which a voice lies: what a head makes of its octaves there, and the
// power that they have there in all.
struct HrtfCorner {
  const std::array<Bands, kEars>* level;
  std::array<Bands, kEars>* power;
  float share;
};

// The same to what a head makes of a voice's octaves, whose signal has so much power in each;
// `targets` are not read.
bool ramp_hrtf_gains(const BusGains& buses, const std::array<HrtfCorner, 3>& corners,
                     const std::array<Bands, kEars>& gain, const Bands& mean_square,
                     const GainRamps& lines) noexcept REALTIME;

}  // namespace clamor
