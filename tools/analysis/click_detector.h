// click_detector.h: finds what a steady hand would not have played: ticks, steps, torn waves.
//
// What 32 past samples do not foretell of the next one is the residual of linear prediction. Tones,
// speech and noise leave little of it, evenly; a jump leaves all of itself. The prediction is
// fitted to every 43 ms (autocorrelation under a Hann window, Levinson's recursion), and a sample
// is an outlier where its residual is beyond 12 robust standard deviations: the median magnitude
// over 5 ms, over 0.6745, the greatest of this stretch and its neighbours, so that a sound that
// sets in does not count against itself. Outliers less than 5 ms apart are one click.
//
// J. Makhoul. Linear prediction: a tutorial review. Proc. IEEE 63, 1975. S. V. Vaseghi, P. J. W.
// Rayner. Detection and suppression of impulsive noise in speech communication systems. IEE Proc. I
// 137, 1990. Any click is noticeable; but sharp attacks are clicks too, so compare with the exact
// mix: only those count that it does not have.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace clamor {

struct Click {
  std::size_t frame = 0;  // its greatest outlier
  double sigmas = 0;      // the residual there, in robust standard deviations
};

inline constexpr std::size_t kPredictionOrder = 32;
inline constexpr double kClickSigmas = 12, kClickSpacing_s = 0.005;

// At kSampleRate_hz. A residual below `least` is no click whatever surrounds it: give 1e-4 of the
// peak, as 80 dB below it nobody hears one. A recording may begin anywhere: its first
// kPredictionOrder samples are none either. About 2 ms per second of sound.
std::vector<Click> find_clicks(std::span<const float> samples, double least);

// Those of `clicks` that no click of `known` is near, within kClickSpacing_s.
std::vector<Click> new_clicks(std::span<const Click> clicks, std::span<const Click> known);

// Predictor a[0..order) of the next sample: x[n] = sum of a[k] x[n - 1 - k], from autocorrelations
// r[0..order]. All 0 where r[0] is.
std::vector<double> levinson(std::span<const double> r);

}  // namespace clamor
