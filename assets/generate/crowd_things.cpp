#include "crowd_things.h"

#include <array>
#include <cmath>
#include <numbers>

#include "dice.h"

namespace clamor::assets {

namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr std::uint64_t kSeedsApart = 100;  // of two variations, so that no two share a seed

double time_s(std::size_t frame) { return static_cast<double>(frame) / kRate_hz; }

// A blown tone that is nearly a sine, with the hiss of the jet close to it.
class Whistle {
 public:
  explicit Whistle(std::uint64_t seed) : dice_(seed), flutter_(60), hiss_(350) {}

  double tick(double frequency_hz) {
    const double wander = 1 + 0.02 * flutter_.tick(dice_.normal());
    phase_ += kTwoPi * frequency_hz * wander / kRate_hz;
    const double jet = hiss_.tick(dice_.normal());
    return std::sin(phase_) * (1 + 0.8 * jet) + 0.06 * std::sin(2 * phase_) +
           0.02 * std::sin(3 * phase_);
  }

 private:
  Dice dice_;
  LowPass flutter_, hiss_;
  double phase_ = 0;
};

Samples clap(Dice& dice) {
  Samples sound(frames(0.12));
  const double cup = std::exp2(dice.between(-0.35, 0.35));  // how the hands are cupped
  BandPass palm(900 * cup, 2.2), fingers(1900 * cup, 1.8), skin(4200 * cup, 1.2);
  const double second_s = dice.between(0.002, 0.006);
  const double decay_s = dice.between(0.007, 0.012), level = dice.between(0.75, 1.0);
  for (std::size_t i = 0; i < sound.size(); ++i) {
    const double t = time_s(i);
    double burst = std::exp(-t / 0.0012);
    if (t > second_s) burst += 0.8 * std::exp(-(t - second_s) / decay_s);
    const double noise = burst * smooth_step(0, 0.0003, t) * dice.normal();
    sound[i] = level * (1.2 * palm.tick(noise) + fingers.tick(noise) + 0.5 * skin.tick(noise)) *
               (1 - smooth_step(0.09, 0.12, t));
  }
  return sound;
}

// A membrane of 60 cm: its pitch falls as the stroke's tension goes; the beater slaps.
Samples drum_stroke(double level, double pitch, Dice& dice) {
  Samples sound(frames(0.9));
  constexpr std::array kModes = {1.0, 1.59, 2.14, 2.30, 2.65};  // of an ideal membrane
  std::array<double, kModes.size()> phases{};
  LowPass felt(900);
  for (std::size_t i = 0; i < sound.size(); ++i) {
    const double t = time_s(i), f_hz = pitch * (68 + 34 * level * std::exp(-t / 0.035));
    double tone = 0;
    for (std::size_t m = 0; m < kModes.size(); ++m) {
      phases[m] += kTwoPi * f_hz * kModes[m] / kRate_hz;
      tone += std::sin(phases[m]) * std::exp(-t / (0.26 / kModes[m])) /
              (1.0 + 1.3 * static_cast<double>(m));
    }
    const double slap = 1.6 * felt.tick(dice.normal()) * std::exp(-t / 0.014);
    sound[i] = level * (tone + slap) * smooth_step(0, 0.002, t) * (1 - smooth_step(0.7, 0.9, t));
  }
  return sound;
}

}  // namespace

Samples whistle_fingers(const Variation& how) {
  Samples sound(frames(1.1 / how.tempo));
  Whistle whistle(21 + kSeedsApart * how.seed);
  for (std::size_t i = 0; i < sound.size(); ++i) {
    const double t = time_s(i) * how.tempo;
    const double f_hz = 1650 + 1350 * smooth_step(0, 0.16, t) + 250 * smooth_step(0.16, 0.42, t) -
                        900 * smooth_step(0.45, 0.62, t) + 1400 * smooth_step(0.64, 0.80, t) -
                        1100 * smooth_step(0.85, 1.08, t);
    const double level = smooth_step(0, 0.03, t) * (1 - 0.9 * smooth_step(0.54, 0.61, t)) +
                         0.9 * smooth_step(0.64, 0.68, t) * (1 - smooth_step(0.92, 1.08, t)) -
                         0.1 * smooth_step(0.60, 0.64, t);
    sound[i] = level * whistle.tick(how.pitch * f_hz);
  }
  Samples track;
  add_at(0.02, sound, track);
  return track;
}

Samples whistle_pea(const Variation& how) {
  Samples track;
  double at_s = 0.02;
  for (const double blow_s : {0.28, 1.15}) {
    const double length_s = blow_s / how.tempo;
    Samples sound(frames(length_s));
    const std::uint64_t seed = kSeedsApart * how.seed;
    Whistle whistle(22 + seed), second(23 + seed);
    double turn = 0;
    for (std::size_t i = 0; i < sound.size(); ++i) {
      const double t = time_s(i);
      // The pea closes the slot once a turn, and runs up as the breath does.
      turn += kTwoPi * how.tempo * (26 + 10 * smooth_step(0, 0.3, t)) / kRate_hz;
      const double open = 0.5 + 0.5 * std::cos(turn);
      const double level =
          smooth_step(0, 0.015, t) * (1 - smooth_step(length_s - 0.05, length_s, t));
      sound[i] = level * (0.25 + 0.75 * open) *
                 (whistle.tick(how.pitch * (2860 + 90 * open)) +
                  0.5 * second.tick(how.pitch * (3420 + 60 * open)));
    }
    add_at(at_s, sound, track);
    at_s += length_s + 0.16;
  }
  return track;
}

Samples claps_regular(const Variation& how) {
  Samples track;
  Dice dice(24 + kSeedsApart * how.seed);
  for (int i = 0; i < 4; ++i) {
    const double at_s = (0.05 + 0.5 * i) / how.tempo + dice.between(-0.012, 0.012);
    add_at(at_s, clap(dice), track);
  }
  return track;
}

Samples claps_fast(const Variation& how) {
  Samples track;
  Dice dice(25 + kSeedsApart * how.seed);
  constexpr int kClaps = 13;
  for (int i = 0; i < kClaps; ++i) {
    const double at_s = (0.04 + 1.9 * i / kClaps) / how.tempo + dice.between(-0.018, 0.018);
    add_at(at_s, clap(dice), track);
  }
  return track;
}

Samples horn(const Variation& how) {
  const double length_s = 2.5 / how.tempo;
  Samples sound(frames(length_s));
  Dice dice(26 + kSeedsApart * how.seed);
  LowPass drift(4), lips(25), air(3000);
  BandPass bell(900, 1.0);
  double phase = 0;
  for (std::size_t i = 0; i < sound.size(); ++i) {
    const double t = time_s(i);
    const double level = smooth_step(0, 0.09, t) * (1 - smooth_step(length_s - 0.25, length_s, t));
    const double attack = how.pitch * (0.94 + 0.06 * smooth_step(0, 0.12, t));
    phase += kTwoPi * 233.1 * attack * (1 + 0.25 * drift.tick(0.05 * dice.normal())) / kRate_hz;
    const double buzz = 1 + 1.5 * lips.tick(dice.normal());
    // Lips clip the flow: the louder, the more overtones.
    double tone = 0;
    for (int k = 1; k <= 24; ++k)
      tone += std::sin(k * phase) * std::pow(0.45 + 0.35 * level, k - 1) * (k == 1 ? 0.6 : 1.0);
    tone *= level * buzz;
    sound[i] = 0.6 * tone + bell.tick(tone) + 0.03 * level * air.tick(dice.normal());
  }
  Samples track;
  add_at(0.02, sound, track);
  return track;
}

Samples drum(const Variation& how) {
  Samples track;
  Dice dice(27 + kSeedsApart * how.seed);
  for (const auto& [at_s, level] : {std::pair{0.0, 1.0}, std::pair{0.6, 0.85}, std::pair{1.2, 1.0},
                                    std::pair{1.5, 0.8}, std::pair{1.8, 0.9}})
    add_at(at_s / how.tempo + 0.02, drum_stroke(level, how.pitch, dice), track);
  return track;
}

}  // namespace clamor::assets
