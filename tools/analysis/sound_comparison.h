// sound_comparison.h: compares two recordings by perceptual measures.
//
// Each sound is analysed once. Two analyses give one Difference per measure: the value of either
// sound, their difference at each place (octave, ERB band, time, ear), and the place where the
// difference is largest relative to the just-noticeable difference (JND). kMeasures lists them with
// their sources. Their definitions and JNDs are in these files:
//
// * programme_loudness.h: integrated and momentary loudness. Times more than 40 LU below the
//   loudest of either sound count as at that floor.
// * sound_spectrum.h, erb_bands.h: the long-term spectrum including the level. Bands more than 60
//   dB below the loudest of either sound count as at that floor.
// * binaural_cues.h: ILD, ITD and IACC, in stereo.
// * click_detector.h: clicks of B that A does not have.
// * texture_statistics.h: envelopes in ERB bands. A and B are means over the bands; the difference
//   is the root mean square of the bands' differences.
// * decay_curve.h, room_parameters.h, echo_density.h: impulse responses, per octave and ear, judged
//   from 125 Hz to 4 kHz, the range of ISO 3382-1, echo density from 500 Hz. Curves are compared
//   down to -35 dB; 1 dB is noticeable, as for any level.
// * time_varying_part.h: the energy that no fixed filter makes of the dry signal, if that is known.
//
// Differences of the waveform are relative L2 = |b - a| / |a|, absolute and with b normalised to
// the energy of a (the paper, figure 4), and correlation rho, L2^2 = 1 + g^2 - 2 g rho, g = |b| /
// |a|. They have no JND: an exact rendering of a crowd with other phases has an L2 of 1.4
// (null_distribution.h).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "tools/analysis/measures.h"
#include "tools/analysis/sound_analysis.h"

namespace clamor {

// A measure at one place.
struct DifferencePoint {
  double at = 0;                    // Hz or s, if the measure has places
  std::optional<int> channel = {};  // if it is taken in each ear separately
  std::optional<double> a = {}, b = {};
  std::optional<double> difference = {};  // b - a (decay times: in percent of a)
  double jnd = 0;
  bool judged = true;  // false outside the range of its JND
};

struct Difference {
  const MeasureInfo* info = nullptr;
  std::vector<DifferencePoint> points;

  // The judged point with the largest difference in JNDs; null if there is none.
  const DifferencePoint* worst() const;

  // |difference| there, in JNDs; unscaled if there is no JND or it is 0. 0 without a point.
  double size() const;

  // Larger than the JND, and larger than `null_size` if chance makes differences of that size.
  bool audible(double null_size = 0) const;

  // For a measure that is judged by chance only: larger than chance makes.
  bool beyond_chance(double null_size) const;
};

// Both sounds must be of one kind with as many channels. The shorter one continues with silence.
std::vector<Difference> compare(const SoundAnalysis& a, const SoundAnalysis& b);

// Compares two renderings of one dry signal, in addition to compare() (time_varying_part.h).
Difference compare_time_varying_parts(std::span<const float> dry, const Sound& a, const Sound& b);

}  // namespace clamor
