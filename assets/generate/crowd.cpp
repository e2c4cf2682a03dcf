#include "crowd.h"

#include <cmath>
#include <utility>

#include "crowd_things.h"
#include "dice.h"
#include "voice.h"

namespace clamor::assets {

namespace {

enum class Onset { kSoft, kH, kL, kB };

struct Syllable {
  double start_s, length_s;
  double f0_start_hz, f0_middle_hz, f0_end_hz;
  Vowel from, to;
  Onset onset = Onset::kSoft;
  double voice = 1;
  double end_s_hiss = 0;  // seconds of s at its end
};

void add_onset(const Syllable& s, std::vector<Moment>& moments) {
  const double t = s.start_s, f0 = s.f0_start_hz;
  switch (s.onset) {
    case Onset::kSoft:
      moments.push_back({t, f0, s.from});
      moments.push_back({t + 0.06, f0, s.from, s.voice});
      break;
    case Onset::kH:
      moments.push_back({t, f0, s.from});
      moments.push_back({t + 0.05, f0, s.from, 0, 0.7});
      moments.push_back({t + 0.09, f0, s.from, 0.1 * s.voice, 0.6});
      moments.push_back({t + 0.13, f0, s.from, s.voice});
      break;
    case Onset::kL:
      moments.push_back({t, f0, kL});
      moments.push_back({t + 0.03, f0, kL, 0.4 * s.voice});
      moments.push_back({t + 0.07, f0, kL, 0.45 * s.voice});
      moments.push_back({t + 0.11, f0, s.from, s.voice});
      break;
    case Onset::kB:
      moments.push_back({t, f0, kBilabial});
      moments.push_back({t + 0.03, f0, kBilabial, 0.2 * s.voice});
      moments.push_back({t + 0.07, f0, kBilabial, 0.2 * s.voice, 0.1});
      moments.push_back({t + 0.09, f0, s.from, s.voice, 0.1});
      break;
  }
}

Samples say(const Throat& throat, const std::vector<Syllable>& syllables) {
  std::vector<Moment> moments = {{0, syllables.front().f0_start_hz, syllables.front().from}};
  for (const Syllable& s : syllables) {
    add_onset(s, moments);
    const double end_s = s.start_s + s.length_s;
    moments.push_back({s.start_s + 0.5 * s.length_s, s.f0_middle_hz, s.from, s.voice});
    moments.push_back({end_s - 0.08, s.f0_end_hz, s.to, 0.85 * s.voice});
    if (s.end_s_hiss > 0) {
      moments.push_back({end_s - 0.02, s.f0_end_hz, s.to, 0, 0.05, 0.8});
      moments.push_back({end_s + s.end_s_hiss - 0.08, s.f0_end_hz, s.to, 0, 0, 0.7});
    }
    moments.push_back({end_s + s.end_s_hiss, s.f0_end_hz, s.to});
  }
  // The tract rings on for a moment.
  moments.push_back({moments.back().time_s + 0.05, moments.back().f0_hz, moments.back().vowel});
  return speak(throat, moments);
}

// A phrase of the paper's stadium, or a variation of it.
Samples sing(const Variation& how, Throat throat, std::vector<Syllable> syllables) {
  throat.seed += 100 * how.seed;
  for (Syllable& s : syllables) {
    for (double* const time_s : {&s.start_s, &s.length_s}) *time_s /= how.tempo;
    for (double* const f0_hz : {&s.f0_start_hz, &s.f0_middle_hz, &s.f0_end_hz}) *f0_hz *= how.pitch;
  }
  return say(throat, syllables);
}

// "Ooh, eh, ooh", low.
Samples chant_deep(const Variation& how) {
  return sing(how,
              {.tract_scale = 0.95, .tilt_hz = 2500, .jitter = 0.012, .strain = 0.8, .seed = 11},
              {{0.02, 0.80, 98, 103, 104, kO, kO},
               {0.86, 0.38, 131, 133, 130, kE, kE, Onset::kH},
               {1.28, 0.92, 110, 108, 97, kO, kU}});
}

// "La, la, la, la", a child or a high voice.
Samples chant_high(const Variation& how) {
  return sing(
      how,
      {.tract_scale = 1.27, .open_quotient = 0.6, .breath = 0.08, .vibrato_cents = 12, .seed = 12},
      {{0.02, 0.46, 392, 394, 392, kA, kA, Onset::kL},
       {0.50, 0.46, 392, 395, 392, kA, kA, Onset::kL},
       {0.98, 0.46, 440, 444, 438, kA, kA, Onset::kL},
       {1.46, 0.48, 330, 331, 326, kA, kA, Onset::kL}});
}

// "Hey!"
Samples shout_male(const Variation& how) {
  return sing(how,
              {.open_quotient = 0.4,
               .tilt_hz = 6000,
               .jitter = 0.02,
               .shimmer = 0.1,
               .strain = 2.5,
               .seed = 13},
              {{0.02, 0.62, 165, 245, 150, kE, kI, Onset::kH}});
}

// "Yes!"
Samples shout_female(const Variation& how) {
  return sing(how,
              {.tract_scale = 1.17,
               .open_quotient = 0.5,
               .tilt_hz = 5000,
               .breath = 0.08,
               .jitter = 0.012,
               .strain = 1.5,
               .seed = 14},
              {{0.02, 0.16, 330, 370, 420, kI, kI},
               {0.12, 0.44, 430, 480, 360, kE, kE, Onset::kSoft, 1, 0.30}});
}

// Eight notes up and down, sung by a tenor; a tune of our own.
Samples song_phrase(const Variation& how) {
  const double g = 196.0, a = 220.0, b = 246.9, d = 293.7, e = 329.6;
  return sing(how, {.open_quotient = 0.55, .tilt_hz = 3500, .vibrato_cents = 35, .seed = 15},
              {{0.00, 0.44, g, g, g, kO, kO},
               {0.46, 0.22, a, a, a, kE, kE, Onset::kL},
               {0.70, 0.46, b, b, b, kA, kA, Onset::kL},
               {1.18, 0.46, d, d, d, kO, kO, Onset::kH},
               {1.66, 0.46, e, e, d, kE, kI, Onset::kL},
               {2.14, 0.46, d, d, d, kA, kA, Onset::kB},
               {2.62, 0.34, b, b, b, kO, kO, Onset::kL},
               {2.98, 0.90, a, g, g, kA, kO, Onset::kL}});
}

// "Woo-hoo!", falsetto.
Samples cheer(const Variation& how) {
  return sing(
      how,
      {.tract_scale = 1.1,
       .open_quotient = 0.7,
       .tilt_hz = 3000,
       .breath = 0.2,
       .jitter = 0.006,
       .vibrato_cents = 25,
       .vibrato_hz = 6.5,
       .strain = 1,
       .seed = 16},
      {{0.02, 1.10, 330, 640, 560, kU, kO}, {1.25, 0.95, 500, 760, 420, kU, kU, Onset::kH}});
}

// "Boo."
Samples boo(const Variation& how) {
  return sing(how,
              {.open_quotient = 0.6,
               .tilt_hz = 1800,
               .breath = 0.1,
               .jitter = 0.015,
               .shimmer = 0.08,
               .seed = 17},
              {{0.02, 2.45, 148, 128, 101, kU, kU, Onset::kB}});
}

// Exponents: a mouth shadows its own head the more the higher the sound.
constexpr Bands kMouth = {0.05f, 0.1f, 0.2f, 0.4f, 0.7f, 1.1f, 1.7f, 2.4f};
constexpr Bands kHands = {0, 0, 0.1f, 0.2f, 0.4f, 0.6f, 0.8f, 1};
constexpr Bands kBell = {0.1f, 0.2f, 0.4f, 0.8f, 1.5f, 2.5f, 4, 6};
constexpr Bands kDrum = {0, 0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f, 0.8f};

struct Kind {
  std::string name;
  Samples (*utter)(const Variation&);
  double paper_loop_s;
  double share;
  bool in_unison;
  double gain_db;
  Bands directivity;
  int takes, utterances;
  double max_pause_s;
};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> kKinds = {
      {"chant_deep", chant_deep, 2.4, 16, true, -12, kMouth, 4, 1, 0.8},
      {"chant_high", chant_high, 2.0, 8, true, -12, kMouth, 6, 1, 0.6},
      {"shout_male", shout_male, 1.5, 12, false, -10, kMouth, 3, 2, 1.4},
      {"shout_female", shout_female, 1.75, 8, false, -10, kMouth, 3, 2, 1.4},
      {"song_phrase", song_phrase, 4.0, 14, true, -12, kMouth, 4, 1, 0.5},
      {"cheer", cheer, 2.6, 10, false, -12, kMouth, 3, 1, 1.2},
      {"boo", boo, 2.9, 6, true, -14, kMouth, 3, 1, 0.8},
      {"whistle_fingers", whistle_fingers, 1.7, 2, false, -8, kMouth, 5, 2, 1.4},
      {"whistle_pea", whistle_pea, 2.2, 0.6, false, -10, kMouth, 3, 1, 2.2},
      {"claps_regular", claps_regular, 2.0, 12, true, -12, kHands, 4, 1, 0.5},
      {"claps_fast", claps_fast, 1.9, 8, false, -12, kHands, 3, 1, 0.5},
      {"horn", horn, 3.1, 1, false, -6, kBell, 3, 1, 1.5},
      {"drum", drum, 2.4, 0.4, false, -4, kDrum, 4, 1, 0.8},
  };
  return kKinds;
}

CrowdSound sound_of(std::size_t kind, std::string name, const Loop& loop, double share) {
  const Kind& k = kinds()[kind];
  return {std::move(name), kind,         mastered(loop.samples()), share, k.in_unison,
          k.gain_db,       k.directivity};
}

// One singer or player: utterances with pauses of chance, so that no two takes repeat alike.
Loop make_take(const Kind& kind, std::uint64_t seed) {
  Dice dice(seed);
  const double pitch = std::exp2(dice.between(-2, 2) / 12), tempo = dice.between(0.8, 1);
  Samples track;
  double at_s = dice.between(0, 0.2);
  for (int i = 0; i < kind.utterances; ++i) {
    Variation how{pitch, tempo, 100 * seed + static_cast<std::uint64_t>(i)};
    how.pitch *= std::exp2(dice.between(-0.5, 0.5) / 12);
    how.tempo *= dice.between(0.95, 1);
    const Samples sound = kind.utter(how);
    add_at(at_s, sound, track);
    at_s += static_cast<double>(sound.size()) / kRate_hz + dice.between(0.3, 1) * kind.max_pause_s;
  }
  Loop loop(at_s);
  loop.add(0, track);
  return loop;
}

}  // namespace

std::vector<CrowdSound> make_paper_sounds() {
  std::vector<CrowdSound> sounds;
  for (std::size_t k = 0; k < kinds().size(); ++k) {
    const Kind& kind = kinds()[k];
    Loop loop(kind.paper_loop_s);
    loop.add(0, kind.utter({}));
    sounds.push_back(sound_of(k, kind.name, loop, kind.share));
  }
  return sounds;
}

std::vector<CrowdSound> make_crowd_sounds() {
  std::vector<CrowdSound> sounds;
  for (std::size_t k = 0; k < kinds().size(); ++k) {
    const Kind& kind = kinds()[k];
    for (int t = 0; t < kind.takes; ++t)
      sounds.push_back(sound_of(k, kind.name + "_" + std::to_string(t + 1),
                                make_take(kind, 1000 + 10 * k + static_cast<std::size_t>(t)),
                                kind.share / kind.takes));
  }
  return sounds;
}

}  // namespace clamor::assets
