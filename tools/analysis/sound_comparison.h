// sound_comparison.h: how far one recording is from another, in what the ear can tell apart.
//
// Each sound is analysed once; two analyses give one Difference per measure: the value in either
// sound, their difference at each place it was taken (octave, ERB band, moment, ear), and the place
// where it is greatest against the just-noticeable difference (JND). kMeasures lists them with
// their sources. What each means, and what is noticed of it, is said where it is taken:
//
// * programme_loudness.h: integrated and momentary loudness. Moments more than 40 LU below the
//   loudest of either sound count as at that floor.
// * sound_spectrum.h, erb_bands.h: the long-term spectrum, levels included. Bands more than 60
//   dB below the loudest of either sound count as at that floor.
// * binaural_cues.h: ILD, ITD and IACC, in stereo.
// * click_detector.h: clicks of B that A does not have.
// * texture_statistics.h: envelopes in ERB bands. A and B are means over the bands, the
//   difference is the root of the mean square of the bands' differences.
// * decay_curve.h, room_parameters.h, echo_density.h: impulse responses, per octave and ear;
//   judged from 125 Hz to 4 kHz, the range of ISO 3382-1, echo density from 500 Hz. The curves
//   are compared down to -35 dB; 1 dB is noticed, as of any level.
// * time_varying_part.h: what no fixed filter makes of the dry signal, where that is known.
//
// and the waveform's own: relative L2 = |b - a| / |a|, absolute and with b brought to the energy of
// a (the paper, figure 4), and correlation rho, L2^2 = 1 + g^2 - 2 g rho, g = |b| / |a|. They have
// no JND: an exact rendering of a crowd with other phases has an L2 of 1.4 (null_distribution.h).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "tools/analysis/measures.h"
#include "tools/analysis/sound_analysis.h"

namespace clamor {

// A measure at one place.
struct DifferencePoint {
  double at = 0;                    // Hz or s, where the measure has places
  std::optional<int> channel = {};  // where it is taken in each ear alone
  std::optional<double> a = {}, b = {};
  std::optional<double> difference = {};  // b - a (decay times: in percent of a)
  double jnd = 0;
  bool judged = true;  // outside the range of its JND it is only told
};

struct Difference {
  const MeasureInfo* info = nullptr;
  std::vector<DifferencePoint> points;

  // The judged point whose difference is the most JNDs; null where there is nothing to compare.
  const DifferencePoint* worst() const;

  // |difference| there, in JNDs; as it is where there is no JND or it is 0. 0 without a point.
  double size() const;

  // Beyond the JND, and beyond `null_size` where chance alone makes differences of that size.
  bool audible(double null_size = 0) const;

  // Of a measure that only chance can judge: more than chance makes.
  bool beyond_chance(double null_size) const;
};

// Both of one kind and with as many channels. The shorter is silent from its end on.
std::vector<Difference> compare(const SoundAnalysis& a, const SoundAnalysis& b);

// Compares two renderings of one dry signal, beside what compare() finds (time_varying_part.h).
Difference compare_time_varying_parts(std::span<const float> dry, const Sound& a, const Sound& b);

}  // namespace clamor
