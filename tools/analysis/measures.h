// measures.h: the measures by which two sounds are compared, each with its source and its
// just-noticeable difference (JND).
#pragma once

#include <array>
#include <optional>

#include "tools/analysis/sound_analysis.h"

namespace clamor {

enum class Measure {
  kIntegratedLoudness,
  kMomentaryLoudness,
  kSpectrum,
  kDecayCurve,
  kEdt,
  kT20,
  kT30,
  kC80,
  kD50,
  kTs,
  kG,
  kEchoDensity,
  kIld,
  kItd,
  kIacc,
  kEarlyIacc,
  kClicks,
  kEnvelopeVariation,
  kEnvelopeSkewness,
  kEnvelopeKurtosis,
  kModulation,
  kBandCorrelation,
  kL2,
  kRenormalisedL2,
  kCorrelation,
  kTimeVaryingPart,  // needs the dry signal too
};

struct MeasureInfo {
  Measure measure;
  const char* key;                   // in JSON
  const char* title;                 // in tables
  const char* value_unit;            // of the value of either sound
  const char* unit;                  // of the difference and the JND
  int digits;                        // significant digits
  std::optional<double> jnd;         // 0: any difference is noticed
  std::optional<SoundKind> only_in;  // kind of sound that it applies to
  const char* place;                 // unit of Point::at: "Hz", "s" or ""
  const char* source;                // of the measure
  const char* jnd_source;
  bool by_chance = false;  // has no JND; judged by a null distribution only
};
extern const std::array<MeasureInfo, 26> kMeasures;

}  // namespace clamor
