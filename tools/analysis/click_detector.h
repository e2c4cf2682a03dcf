// click_detector.h: finds clicks: short discontinuities in a sound.
//
// The detector uses the residual of linear prediction from 32 past samples. Tones, speech and noise
// leave a small and even residual; a discontinuity leaves a large one. The predictor is fitted
// every 43 ms (autocorrelation under a Hann window, Levinson recursion). A sample is an outlier if
// its residual exceeds 12 robust standard deviations: the median magnitude over 5 ms divided by
// 0.6745, the maximum of this interval and its neighbours, so that the onset of a sound is not
// judged by the silence before it. Outliers less than 5 ms apart form one click.
//
// J. Makhoul. Linear prediction: a tutorial review. Proc. IEEE 63, 1975. S. V. Vaseghi, P. J. W.
// Rayner. Detection and suppression of impulsive noise in speech communication systems. IEE Proc. I
// 137, 1990. Any click is noticeable, but sharp attacks are clicks too, so only clicks that the
// exact mix does not have count.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace clamor {

struct Click {
  std::size_t frame = 0;  // of its largest outlier
  double sigmas = 0;      // the residual there, in robust standard deviations
};

inline constexpr std::size_t kPredictionOrder = 32;
inline constexpr double kClickSigmas = 12, kClickSpacing_s = 0.005;

// `samples` are at kSampleRate_hz. A residual below `least` is never a click; give 1e-4 of the
// peak, since clicks 80 dB below it are inaudible. The first kPredictionOrder samples are never
// clicks, since a recording may begin anywhere. Takes about 2 ms per second of sound.
std::vector<Click> find_clicks(std::span<const float> samples, double least);

// Clicks that are farther than kClickSpacing_s from every click in `known`.
std::vector<Click> new_clicks(std::span<const Click> clicks, std::span<const Click> known);

// The predictor x[n] = sum of a[k] x[n - 1 - k], a[0..order), from autocorrelations r[0..order].
// All 0 if r[0] is.
std::vector<double> levinson(std::span<const double> r);

}  // namespace clamor
