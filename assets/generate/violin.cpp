#include "violin.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include <stk/Bowed.h>

#include "dice.h"
#include "sound.h"

namespace clamor::assets {

namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

// The bow and the left hand at one frame.
struct Gesture {
  double f0_hz;
  double velocity;  // of the bow, signed: down and up
  double pressure;  // 0 to 1
};

// STK's bowed string with access to its parameters.
class BowedString : public stk::Bowed {
 public:
  BowedString() : stk::Bowed(100) {
    adsr_.setValue(1);  // our gestures shape the bow, not STK's envelope
    bowDown_ = true;
    vibratoGain_ = 0;
  }

  // Velocity of the string at the bridge.
  double play(const Gesture& gesture) {
    // The loop's filter and table delay by about this many frames; found by ear and
    // autocorrelation.
    constexpr double kLoopDelay_frames = 3.55;
    constexpr double kBowPlace = 0.127;  // share of the string between bow and bridge
    const double delay = kRate_hz / gesture.f0_hz - kLoopDelay_frames;
    bridgeDelay_.setDelay(delay * kBowPlace);
    neckDelay_.setDelay(delay * (1 - kBowPlace));
    bowTable_.setSlope(5 - 4 * gesture.pressure);
    maxVelocity_ = gesture.velocity;
    tick();
    return bridgeDelay_.lastOut();
  }
};

// Air and wood: A0, B1-, B1+, a thicket of plate modes, and the bridge hill about 2.5 kHz.
class Body {
 public:
  Body() {
    for (const auto& [frequency_hz, quality, gain] :
         {Mode{278, 10, 0.5}, Mode{405, 12, 0.3}, Mode{455, 12, 0.5}, Mode{548, 12, 0.5}})
      add(frequency_hz, quality, gain);
    Dice dice(31);
    for (double frequency_hz = 680; frequency_hz < 6000; frequency_hz *= dice.between(1.06, 1.16)) {
      const double hill = std::exp(-std::pow(std::log2(frequency_hz / 2500) / 0.8, 2));
      const double quality = dice.between(16, 30), sign = dice.unit() < 0.5 ? -1 : 1;
      add(frequency_hz, quality, (0.25 + 0.55 * hill) * sign);
    }
    add(2500, 1.4, 1.6);
    add(1000, 1.5, 0.6);
  }

  double tick(double bridge) {
    double out = 0.3 * bridge;
    for (Weighted& mode : modes_) out += mode.gain * mode.filter.tick(bridge);
    return roof_.tick(out);
  }

 private:
  struct Mode {
    double frequency_hz, quality, gain;
  };
  struct Weighted {
    BandPass filter;
    double gain;
  };
  void add(double frequency_hz, double quality, double gain) {
    modes_.push_back({BandPass(frequency_hz, quality), gain});
  }

  std::vector<Weighted> modes_;
  LowPass roof_{7000};
};

struct Note {
  double beat, beats;  // start and length
  int key;             // MIDI: 69 is the A of 440 Hz
  double loudness;     // 0 to 1
  bool slurred;        // on the bow of the note before
};

// Enough for the string to slip once a period on every note; with less, high notes slip twice and
// sound an octave up.
constexpr double kPressure = 0.7;

constexpr double kBeat_s = 0.8;
constexpr double kLength_s = 11.5;

// In D, three-four time; rises to the A, sinks back.
constexpr Note kPhrase[] = {
    {0.0, 1.0, 69, 0.50, false},   // A4, upbeat
    {1.0, 1.5, 74, 0.65, false},   // D5
    {2.5, 0.5, 76, 0.65, true},    // E5
    {3.0, 1.0, 78, 0.75, true},    // F#5
    {4.0, 1.5, 81, 0.95, false},   // A5
    {5.5, 0.5, 79, 0.90, true},    // G5
    {6.0, 0.5, 78, 0.80, false},   // F#5
    {6.5, 0.5, 76, 0.75, true},    // E5
    {7.0, 1.0, 78, 0.75, false},   // F#5
    {8.0, 0.5, 76, 0.65, false},   // E5
    {8.5, 0.5, 73, 0.60, true},    // C#5
    {9.0, 1.0, 71, 0.60, true},    // B4
    {10.0, 1.0, 69, 0.60, false},  // A4
    {11.0, 2.0, 62, 0.60, false},  // D4, on the G string
};

double frequency_of(int key) { return 440 * std::exp2((key - 69) / 12.0); }

// State of both hands at a moment of the phrase.
Gesture gesture_at(double time_s) {
  const double beat = time_s / kBeat_s;
  std::size_t index = 0;
  while (index + 1 < std::size(kPhrase) && kPhrase[index + 1].beat <= beat) ++index;
  const Note& note = kPhrase[index];
  const bool is_last = index + 1 == std::size(kPhrase);
  const bool next_slurred = !is_last && kPhrase[index + 1].slurred;
  const double since_s = time_s - note.beat * kBeat_s;
  const double left_s = (note.beat + note.beats) * kBeat_s - time_s;

  int strokes = 0;
  for (std::size_t i = 1; i <= index; ++i) strokes += kPhrase[i].slurred ? 0 : 1;
  const double direction = strokes % 2 ? 1 : -1;

  // Slurred notes glide for a moment; vibrato grows on the long ones.
  double f0_hz = frequency_of(note.key);
  if (note.slurred) {
    const double before_hz = frequency_of(kPhrase[index - 1].key);
    f0_hz = before_hz * std::pow(f0_hz / before_hz, smooth_step(0, 0.035, since_s));
  }
  const double depth_cents = (note.beats < 1 ? 4 : 16) * smooth_step(0.12, 0.45, since_s);
  f0_hz *= std::exp2(depth_cents * std::sin(kTwoPi * 5.6 * time_s) / 1200);

  // The bow stops to turn round; a swell in the middle of long notes; the last dies away.
  double bow = 1;
  if (!note.slurred) bow *= smooth_step(0, 0.06, since_s);
  if (is_last)
    bow *= smooth_step(0, 0.7, left_s);
  else if (!next_slurred)
    bow *= smooth_step(0, 0.05, left_s);
  const double middle = std::max(0.0, std::min(since_s, left_s));
  const double swell = 0.8 + 0.2 * smooth_step(0, 0.5, middle);
  const double loudness = note.loudness * swell * bow;
  return {f0_hz, direction * (bow > 0 ? 0.02 + 0.10 * loudness : 0) * bow, kPressure};
}

double rms(std::span<const double> samples) {
  double sum = 0;
  for (const double sample : samples) sum += sample * sample;
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

// A player hears which notes the body favours and bows them less: each note gets the level that
// the phrase wants of it, 12 dB between its softest and loudest.
void even_out(Samples& samples) {
  std::vector<double> gains;
  for (const Note& note : kPhrase) {
    const std::size_t begin = frames((note.beat + 0.25 * note.beats) * kBeat_s);
    const std::size_t length = frames(0.5 * note.beats * kBeat_s);
    gains.push_back(std::exp2(4 * (note.loudness - 1)) /
                    rms(std::span(samples).subspan(begin, length)));
  }
  std::size_t index = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double time_s = static_cast<double>(i) / kRate_hz;
    if (index + 1 < gains.size() && time_s >= kPhrase[index + 1].beat * kBeat_s) ++index;
    const double before = gains[index > 0 ? index - 1 : 0];
    const double start_s = kPhrase[index].beat * kBeat_s;
    samples[i] *= before + (gains[index] - before) * smooth_step(start_s, start_s + 0.04, time_s);
  }
}

}  // namespace

std::vector<std::int16_t> make_violin_phrase() {
  stk::Stk::setSampleRate(kRate_hz);
  BowedString string;
  Body body;
  Dice hair(32);
  LowPass rosin(3000);
  Samples samples(frames(kLength_s));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double time_s = static_cast<double>(i) / kRate_hz;
    Gesture gesture = gesture_at(time_s);
    // Rosin grips unevenly: a little noise in the bow's speed, heard as the bow's hiss.
    gesture.velocity *= 1 + 0.15 * rosin.tick(hair.normal());
    samples[i] = body.tick(string.play(gesture)) *
                 (1 - smooth_step(kLength_s - 0.4, kLength_s - 0.1, time_s));
  }
  even_out(samples);
  return mastered(samples);
}

}  // namespace clamor::assets
