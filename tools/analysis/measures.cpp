#include "tools/analysis/measures.h"

namespace clamor {

namespace {

constexpr auto kProgramme = SoundKind::kProgramme;
constexpr auto kImpulse = SoundKind::kImpulseResponse;
constexpr std::optional<SoundKind> kBoth;
constexpr std::optional<double> kNoJnd;

}  // namespace

const std::array<MeasureInfo, 26> kMeasures = {{
    {Measure::kIntegratedLoudness, "integrated_loudness", "loudness, whole", "LUFS", "LU", 1, 1,
     kProgramme, "", "ITU-R BS.1770-4, integrated (libebur128)", "Zwicker and Fastl 1990"},
    {Measure::kMomentaryLoudness, "momentary_loudness", "loudness, 400 ms", "LUFS", "LU", 1, 1,
     kProgramme, "s", "ITU-R BS.1770-4 and EBU Tech 3341, momentary (libebur128)",
     "Zwicker and Fastl 1990"},
    {Measure::kSpectrum, "spectrum", "spectrum", "dB", "dB", 1, 1, kBoth, "Hz",
     "ERB bands of Glasberg and Moore 1990", "1 to 2 dB in one band: Green 1988"},
    {Measure::kDecayCurve, "decay_curve", "decay curve", "dB", "dB", 1, 1, kImpulse, "Hz",
     "Schroeder 1965, to -35 dB, per octave", "1 dB, as for a level"},
    {Measure::kEdt, "edt", "EDT", "s", "%", 2, 5, kImpulse, "Hz", "ISO 3382-1",
     "ISO 3382-1, table A.1"},
    {Measure::kT20, "t20", "T20", "s", "%", 2, 5, kImpulse, "Hz", "ISO 3382-1",
     "as EDT: ISO 3382-1, table A.1"},
    {Measure::kT30, "t30", "T30", "s", "%", 2, 5, kImpulse, "Hz", "ISO 3382-1",
     "as EDT: ISO 3382-1, table A.1"},
    {Measure::kC80, "c80", "C80", "dB", "dB", 1, 1, kImpulse, "Hz", "ISO 3382-1",
     "ISO 3382-1, table A.1"},
    {Measure::kD50, "d50", "D50", "", "", 3, 0.05, kImpulse, "Hz", "ISO 3382-1",
     "ISO 3382-1, table A.1"},
    {Measure::kTs, "ts", "Ts", "ms", "ms", 1, 10, kImpulse, "Hz", "ISO 3382-1",
     "ISO 3382-1, table A.1"},
    {Measure::kG, "g", "G", "dB", "dB", 1, 1, kImpulse, "Hz", "ISO 3382-1 (differences only)",
     "ISO 3382-1, table A.1"},
    {Measure::kEchoDensity, "echo_density", "echo density", "", "", 2, 0.1, kImpulse, "Hz",
     "Abel and Huang 2006, per octave", "none published; 0.1 is our bound"},
    {Measure::kIld, "ild", "ILD", "dB", "dB", 1, 0.5, kBoth, "Hz", "right over left, per octave",
     "0.5 to 1 dB: Yost and Dye 1988"},
    {Measure::kItd, "itd", "ITD", "us", "us", 0, 10, kBoth, "Hz",
     "cross-correlation of ISO 3382-1 annex B, per octave",
     "Klumpp and Eady 1956; or 0.05 rad where that is more; judged to 1 kHz"},
    {Measure::kIacc, "iacc", "IACC", "", "", 2, 0.075, kBoth, "Hz",
     "ISO 3382-1 annex B, per octave", "ISO 3382-1 annex B"},
    {Measure::kEarlyIacc, "iacc_early", "IACC, early", "", "", 2, 0.075, kImpulse, "Hz",
     "ISO 3382-1 annex B, first 80 ms, per octave", "ISO 3382-1 annex B"},
    {Measure::kClicks, "clicks", "new clicks", "", "", 0, 0, kProgramme, "s",
     "linear-prediction residual: Makhoul 1975, Vaseghi and Rayner 1990", "any"},
    {Measure::kEnvelopeVariation, "envelope_variation", "envelope variation", "", "", 2, kNoJnd,
     kProgramme, "", "texture statistics of McDermott and Simoncelli 2011, RMS over bands",
     "none published: judged by --null", true},
    {Measure::kEnvelopeSkewness, "envelope_skewness", "envelope skewness", "", "", 2, kNoJnd,
     kProgramme, "", "McDermott and Simoncelli 2011", "none published: judged by --null", true},
    {Measure::kEnvelopeKurtosis, "envelope_kurtosis", "envelope kurtosis", "", "", 1, kNoJnd,
     kProgramme, "", "McDermott and Simoncelli 2011", "none published: judged by --null", true},
    {Measure::kModulation, "modulation", "modulation", "dB", "dB", 1, kNoJnd, kProgramme, "",
     "McDermott and Simoncelli 2011, RMS over bands and octaves of modulation",
     "none published: judged by --null", true},
    {Measure::kBandCorrelation, "band_correlation", "band correlation", "", "", 2, kNoJnd,
     kProgramme, "", "McDermott and Simoncelli 2011", "none published: judged by --null", true},
    {Measure::kL2, "l2", "relative L2", "", "", 3, kNoJnd, kBoth, "",
     "Wand and Strasser 2004, figure 4, absolute", "none: for information"},
    {Measure::kRenormalisedL2, "l2_renormalised", " renormalised", "", "", 3, kNoJnd, kBoth, "",
     "Wand and Strasser 2004, figure 4, relative", "none: for information"},
    {Measure::kCorrelation, "correlation", "correlation", "", "", 3, kNoJnd, kBoth, "",
     "of the waveforms", "none: for information"},
    {Measure::kTimeVaryingPart, "time_varying_part", "changes with time", "dB", "dB", 1, kNoJnd,
     kBoth, "", "with --dry: what the best fixed filter leaves, re the whole",
     "none: for information"},
}};

}  // namespace clamor
