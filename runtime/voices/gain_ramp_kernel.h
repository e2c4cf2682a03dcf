// gain_ramp_kernel.h: linear gain ramps from one keyframe to the next, in vectors.
//
// A keyframe of 20 000 voices has 320 000 gains, each a sum over octaves, which the audio thread
// computes at once. Highway is visible only in the .cpp.
#pragma once

#include <array>
#include <cstddef>

#include "common/bands.h"
#include "runtime/realtime/realtime.h"
#include "runtime/voices/mix_kernel.h"

namespace clamor {

// Turns a voice's octave gains into bus gains that make the filtered sum have them: a matrix by
// octave and then by lane, the same for both ears.
struct alignas(64) BusGains {
  std::array<std::array<float, kBandLanes>, kBandCount> columns{};

  using Matrix = std::array<std::array<double, kBandCount>, kBandCount>;  // [bus][octave]
  static BusGains of(const Matrix& matrix);
};

// The bus gains of a voice with these octave gains at its ears.
void bus_lanes(const BusGains& buses, const std::array<Bands, kEars>& gain,
               float* lanes) noexcept REALTIME;

// A linear ramp from `target`, or from 0 if the voice `starts`, to `targets`, which then become the
// target. Writes the initial gains, then their slopes per kGainFrames. Returns true if any gain is
// not 0. `lanes` is kBandLanes, kHrtfLanes or kEars.
struct GainRamps {
  float* target;         // [lanes]
  float* gain;           // [2][lanes]
  const float* targets;  // [lanes]
  std::size_t lanes;
  int frames;
  bool starts;
};
bool ramp_gains(const GainRamps& lines) noexcept REALTIME;

// One of the three measured directions around a voice: the HRTF's octave gains there, and the sum
// of the power of all voices at it.
struct HrtfCorner {
  const std::array<Bands, kEars>* level;
  std::array<Bands, kEars>* power;
  float share;
};

// The octave gains times the HRTF interpolated between the corners, and adds the voice's power to
// the corners. `mean_square` is the signal's power by octave. `coloured` may be `gain`.
void hrtf_gains(const std::array<HrtfCorner, 3>& corners, const std::array<Bands, kEars>& gain,
                const Bands& mean_square, std::array<Bands, kEars>& coloured) noexcept REALTIME;

// Ramps to the bus gains of hrtf_gains(); `targets` is not read.
bool ramp_hrtf_gains(const BusGains& buses, const std::array<HrtfCorner, 3>& corners,
                     const std::array<Bands, kEars>& gain, const Bands& mean_square,
                     const GainRamps& lines) noexcept REALTIME;

}  // namespace clamor
