// sound.h: what all synthesised sounds share: time, loops, resonators, levels, files.
//
// Offline and mono at 48 kHz; full scale is +-1.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/result.h"

namespace clamor::assets {

inline constexpr int kRate_hz = 48000;
inline constexpr double kSilent_db = -30;  // below the loudest frame: a pause, not sound

using Samples = std::vector<double>;

inline std::size_t frames(double time_s) { return static_cast<std::size_t>(time_s * kRate_hz); }

// Two poles, unity gain at 0 Hz: one formant of a vocal tract.
//
// Dennis H. Klatt. Software for a cascade/parallel formant synthesizer. JASA 67(3), 1980.
class Resonator {
 public:
  void tune(double frequency_hz, double bandwidth_hz);
  double tick(double in) {
    const double out = a_ * in + b_ * last_ + c_ * before_;
    before_ = last_;
    return last_ = out;
  }

 private:
  double a_ = 1, b_ = 0, c_ = 0, last_ = 0, before_ = 0;
};

// Two poles, zeros at 0 Hz and half the rate, gain 1 at its frequency: one mode of a body.
class BandPass {
 public:
  BandPass(double frequency_hz, double quality);
  double tick(double in) {
    const double out = gain_ * (in - in_before_) - a1_ * last_ - a2_ * before_;
    in_before_ = in_last_;
    in_last_ = in;
    before_ = last_;
    return last_ = out;
  }

 private:
  double gain_, a1_, a2_, in_last_ = 0, in_before_ = 0, last_ = 0, before_ = 0;
};

// One pole; the time to 63 % is 1 / (2 pi cutoff).
class LowPass {
 public:
  explicit LowPass(double cutoff_hz);
  double tick(double in) { return last_ += share_ * (in - last_); }

 private:
  double share_, last_ = 0;
};

// From 0 at `from` to 1 at `to`, level at both ends; a fade of a half cosine's shape.
double smooth_step(double from, double to, double at);

// Adds a sound to a track that grows as far as needed.
void add_at(double at_s, const Samples& sound, Samples& track);

// Variation of an utterance relative to that of the paper's stadium.
struct Variation {
  double pitch = 1;  // factor on all frequencies of the source
  double tempo = 1;  // above 1 is faster; voices take 1 at most, since onsets keep their length
  std::uint64_t seed = 0;
};

// A sound that repeats. What is added beyond its end comes round to its beginning, so that there
// is no seam.
class Loop {
 public:
  explicit Loop(double length_s) : samples_(frames(length_s), 0.0) {}
  void add(double at_s, const Samples& sound, double gain = 1);
  const Samples& samples() const { return samples_; }

 private:
  Samples samples_;
};

// Without what lies below 25 Hz, its level -20 dBFS (RMS of the frames that are not pauses) or
// less where a peak would pass -1.5 dBFS; 16 bit. A loop stays one.
std::vector<std::int16_t> mastered(Samples loop);

Result<void> write_flac(const std::string& path, const std::vector<std::int16_t>& samples);
Result<std::vector<std::int16_t>> read_flac(const std::string& path);

}  // namespace clamor::assets
