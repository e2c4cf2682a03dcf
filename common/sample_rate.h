// sample_rate.h: the one sample rate of signals, delays and mixes.
#pragma once

namespace clamor {

inline constexpr int kSampleRate_hz = 48000;

}  // namespace clamor
