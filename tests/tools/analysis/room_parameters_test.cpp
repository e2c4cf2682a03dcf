#include "tools/analysis/room_parameters.h"

#include <cmath>

#include <gtest/gtest.h>

#include "common/decay_curve.h"
#include "common/random.h"
#include "runtime/response/impulse_response.h"

namespace clamor {
namespace {

const Bands kUnit = same_in_all_bands(1);

// Arrivals every 0.1 ms whose energy falls by 60 dB in decay_s, starting at `start_s`.
std::vector<Arrival> exponential(double decay_s, double length_s, double start_s = 0,
                                 double energy = 1) {
  std::vector<Arrival> arrivals;
  const double step_s = 1e-4;
  for (int i = 0; i * step_s < length_s; ++i) {
    const double t_s = i * step_s;
    arrivals.push_back({.time_s = start_s + t_s,
                        .energy = same_in_all_bands(
                            static_cast<float>(energy * std::pow(10.0, -6 * t_s / decay_s)))});
  }
  return arrivals;
}

TEST(RoomParameters, OfAnExponentialDecayHaveTheirClosedForms) {
  for (const double decay_s : {0.4, 1.0, 3.0}) {
    const RoomParameters found = room_parameters(exponential(decay_s, 1.2 * decay_s, 0.03), kUnit);
    const double rate = 6 * std::log(10.0) / decay_s;
    const auto after = [&](double t_s) { return std::exp(-rate * t_s); };
    for (std::size_t b = 0; b < kBandCount; ++b) {
      // Steps of 0.1 ms are 0.3 % of 80 ms, 0.02 dB at most.
      EXPECT_NEAR(*found.edt_s[b], decay_s, 1e-3 * decay_s);
      EXPECT_NEAR(*found.t20_s[b], decay_s, 1e-3 * decay_s);
      EXPECT_NEAR(*found.t30_s[b], decay_s, 1e-3 * decay_s);
      EXPECT_NEAR(*found.c80_db[b], 10 * std::log10((1 - after(0.08)) / after(0.08)), 0.02);
      EXPECT_NEAR(*found.d50[b], 1 - after(0.05), 2e-3);
      EXPECT_NEAR(*found.ts_s[b], 1 / rate, 1e-4);
    }
  }
}

TEST(RoomParameters, ReferStrengthToTheFreeFieldAtTenMetres) {
  Emitter emitter{.name = "a", .gain = 0.5};
  emitter.directivity = {0, 0, 0, 0, 1, 1, 1, 3};
  // At 1 m an omnidirectional emitter is 20 dB louder than at 10 m, with any gain. At exponent p
  // the same on-axis level comes from 1 / (p + 1) of the power.
  const std::vector<Arrival> direct = {{.time_s = 1 / 343.2, .energy = same_in_all_bands(0.25f)}};
  const RoomParameters found = room_parameters(direct, free_field_energy_at_10m(emitter));
  EXPECT_NEAR(*found.g_db[0], 20, 1e-5);
  EXPECT_NEAR(*found.g_db[4], 20 + 10 * std::log10(2), 1e-5);
  EXPECT_NEAR(*found.g_db[7], 20 + 10 * std::log10(4), 1e-5);
}

TEST(RoomParameters, OfTheDirectSoundAloneHaveNoDecay) {
  const std::vector<Arrival> direct = {{.time_s = 0.01, .energy = kUnit}};
  const RoomParameters found = room_parameters(direct, kUnit);
  for (std::size_t b = 0; b < kBandCount; ++b) {
    EXPECT_FALSE(found.edt_s[b] || found.t20_s[b] || found.t30_s[b] || found.c80_db[b]);
    EXPECT_EQ(found.d50[b], 1);
    EXPECT_EQ(found.ts_s[b], 0);
  }
  EXPECT_FALSE(room_parameters(std::vector<Arrival>{}, kUnit).g_db[0]);
  EXPECT_FALSE(room_parameters(std::vector<float>(1000), kUnit).g_db[0]);
}

TEST(RoomParameters, AreSeparateForEachBand) {
  std::vector<Arrival> arrivals = exponential(1, 2);
  for (Arrival& arrival : arrivals) {
    arrival.energy[2] = static_cast<float>(std::pow(10.0, -6 * arrival.time_s / 0.5));
    arrival.energy[6] = 0;
  }
  const RoomParameters found = room_parameters(arrivals, kUnit);
  EXPECT_NEAR(*found.t30_s[1], 1, 1e-3);
  EXPECT_NEAR(*found.t30_s[2], 0.5, 1e-3);
  EXPECT_FALSE(found.t30_s[6] || found.c80_db[6] || found.d50[6] || found.ts_s[6] || found.g_db[6]);
}

// A direct sound after which the decay curve falls by `fall_db` at once, and an exponential decay.
std::vector<Arrival> after_direct_sound(double fall_db, double decay_s) {
  std::vector<Arrival> arrivals = exponential(decay_s, 1.2 * decay_s);
  double rest = 0;
  for (const Arrival& arrival : arrivals) rest += static_cast<double>(arrival.energy[0]);
  const auto direct = static_cast<float>(rest * (std::pow(10.0, fall_db / 10) - 1));
  arrivals.insert(arrivals.begin(), {.time_s = 0, .energy = same_in_all_bands(direct)});
  return arrivals;
}

TEST(RoomParameters, HaveNoEarlyDecayTimeIfTheDirectSoundDominates) {
  // The rest of the range after a fall of 3 dB has the slope of the decay.
  EXPECT_NEAR(room_parameters(after_direct_sound(3, 1), kUnit).edt_s[0].value_or(0), 1, 2e-3);
  const RoomParameters found = room_parameters(after_direct_sound(7, 1), kUnit);
  EXPECT_FALSE(found.edt_s[0]);
  // starts at -5 dB, below most of the direct sound
  EXPECT_NEAR(found.t30_s[0].value_or(0), 1, 2e-3);

  // A few faint arrivals follow a strong direct sound; a line through them would give 15 s.
  std::vector<Arrival> near = after_direct_sound(9.9, 0.17);
  near.erase(near.begin() + 12, near.begin() + 60);
  for (std::size_t i = 1; i < 12; ++i) {
    near[i].time_s = 5e-4 * static_cast<double>(i);
    near[i].energy = same_in_all_bands(1e-2f);
  }
  for (std::size_t i = 12; i < near.size(); ++i) near[i].time_s += 1e-3;
  EXPECT_FALSE(room_parameters(near, kUnit).edt_s[0]);
  EXPECT_TRUE(room_parameters(near, kUnit).t20_s[0]);

  // In a waveform the direct sound lasts some milliseconds and many samples.
  const std::vector<Arrival> arrivals = after_direct_sound(9, 1);
  const RoomParameters wave = room_parameters(
      impulse_response(arrivals, whole_response_frames(arrivals)), same_in_all_bands(0.01f));
  for (std::size_t b = 0; b < kBandCount; ++b) EXPECT_FALSE(wave.edt_s[b]) << b;
}

TEST(DecayCurve, WithTwoSlopesIsFittedLikeASampledLine) {
  // -60 dB in 0.3 s and, 20 dB lower, in 2 s.
  const double fast = 6 * std::log(10.0) / 0.3, slow = 6 * std::log(10.0) / 2;
  std::vector<EnergyStep> steps;
  const double step_s = 2e-5;
  for (int i = 0; i * step_s < 3; ++i)
    steps.push_back(
        {i * step_s, std::exp(-fast * i * step_s) + 0.01 * std::exp(-slow * i * step_s)});
  const DecayCurve curve(steps, 3);

  // Reference: the closed form of the curve, sampled every 0.1 ms, and linear regression.
  const auto level_db = [&](double t) {
    const auto left = [&](double at) {
      return std::exp(-fast * at) / fast + 0.01 * std::exp(-slow * at) / slow;
    };
    return 10 * std::log10(left(t) / left(0));
  };
  for (const auto& [from_db, to_db] : {std::pair(0.0, -10.0), {-5.0, -25.0}, {-5.0, -35.0}}) {
    double n = 0, t1 = 0, t2 = 0, l1 = 0, tl = 0;
    for (double t = 0; t < 3; t += 1e-4) {
      const double l = level_db(t);
      if (l > from_db || l < to_db) continue;
      n += 1, t1 += t, t2 += t * t, l1 += l, tl += t * l;
    }
    const double slope = (n * tl - t1 * l1) / (n * t2 - t1 * t1);
    EXPECT_NEAR(*curve.decay_time_s(from_db, to_db) / (-60 / slope), 1, 2e-3) << to_db;
  }
}

TEST(DecayCurve, GivesItsLevelAtAnyTime) {
  // Energies 9, 0.9 and 0.1 at 0, 1 and 2 s: the remaining energy is 10, then 1, then 0.1.
  const DecayCurve curve({{0, 9}, {1, 0.9}, {2, 0.1}}, 3);
  EXPECT_NEAR(curve.level_db(-1), 0, 1e-9);
  EXPECT_NEAR(curve.level_db(0), 0, 1e-9);
  EXPECT_NEAR(curve.level_db(0.5), -10, 1e-9);
  EXPECT_NEAR(curve.level_db(1.5), -20, 1e-9);
  EXPECT_LT(curve.level_db(2.5), -1000);
}

TEST(DecayCurve, HasNoResultBelowTheLevelThatItsLengthReaches) {
  // A decay of 1 s that is cut off. After 0.35 s it is at -21 dB, enough for EDT; after 0.65 s at
  // -39 dB, enough for T20; only after 0.8 s, at -48 dB, is the end 10 dB below the range of T30.
  struct Case {
    double length_s;
    bool edt, t20, t30;
  };
  for (const Case& c : {Case{0.2, false, false, false}, Case{0.4, true, false, false},
                        Case{0.65, true, true, false}, Case{0.85, true, true, true}}) {
    const RoomParameters found = room_parameters(exponential(1, c.length_s), kUnit);
    EXPECT_EQ(found.edt_s[0].has_value(), c.edt) << c.length_s;
    EXPECT_EQ(found.t20_s[0].has_value(), c.t20) << c.length_s;
    EXPECT_EQ(found.t30_s[0].has_value(), c.t30) << c.length_s;
    // The results that exist are right: the missing tail bends the curve by 2 % at most.
    if (c.edt) {
      EXPECT_NEAR(*found.edt_s[0], 1, 0.02);
    }
    if (c.t20) {
      EXPECT_NEAR(*found.t20_s[0], 1, 0.02);
    }
    if (c.t30) {
      EXPECT_NEAR(*found.t30_s[0], 1, 0.02);
    }
  }
}

TEST(DecayCurve, HasNoResultIfItEndsInNoise) {
  std::vector<EnergyStep> steps;
  for (int i = 0; i < 20000; ++i) steps.push_back({i * 1e-4, std::pow(10, -6 * i * 1e-4) + 1e-3});
  const DecayCurve curve(steps, 2);
  EXPECT_FALSE(curve.decay_time_s(-5, -35));
  EXPECT_FALSE(curve.decay_time_s(-5, -25));
}

TEST(DecayCurve, HasNoResultForAFewEchoes) {
  std::vector<EnergyStep> steps;
  for (int i = 0; i < 8; ++i) steps.push_back({i * 0.02, std::pow(10, -i)});
  EXPECT_FALSE(DecayCurve(steps, 0.2).decay_time_s(-5, -35));
}

// A direct sound and a dense tail of random polarity, whose decay differs between bands.
std::vector<Arrival> reverberation(const std::array<double, kBandCount>& decay_s, double length_s,
                                   std::uint64_t seed) {
  std::vector<Arrival> arrivals = {{.time_s = 0.01, .energy = same_in_all_bands(100)}};
  constexpr std::uint32_t kPerSecond = 40000;
  for (std::uint32_t i = 0; i < length_s * kPerSecond; ++i) {
    const RandomBits bits = philox(seed, {i, 0, 0, 0});
    Arrival arrival{.time_s = 0.01 + (i + unit(bits[0])) / kPerSecond,
                    .polarity = bits[1] & 1 ? 1 : -1};
    for (std::size_t b = 0; b < kBandCount; ++b)
      arrival.energy[b] =
          static_cast<float>(0.02 * std::pow(10, -6 * (arrival.time_s - 0.01) / decay_s[b]));
    arrivals.push_back(arrival);
  }
  return arrivals;
}

TEST(RoomParameters, OfTheWaveformAgreeWithThoseOfTheEnergy) {
  // One waveform is one random draw: an octave of width w has about w t independent values in t
  // seconds, so one C80 at 63 Hz has an error of about 3 dB. The test averages many.
  constexpr int kThrows = 24;
  const Bands reference = same_in_all_bands(0.01f);
  Bands t30{}, t20{}, c80_db{}, d50{}, ts_s{}, g_db{};
  RoomParameters energy;
  for (std::uint64_t seed = 1; seed <= kThrows; ++seed) {
    const auto arrivals = reverberation({0.9, 0.85, 0.8, 0.8, 0.75, 0.7, 0.65, 0.6}, 1.1, seed);
    energy = room_parameters(arrivals, reference);
    const RoomParameters wave =
        room_parameters(impulse_response(arrivals, whole_response_frames(arrivals)), reference);
    const auto add = [](Bands& sum, const RoomParameters::Value& found,
                        const RoomParameters::Value& expected, bool ratio) {
      for (std::size_t b = 0; b < kBandCount; ++b)
        sum[b] += static_cast<float>((ratio ? *found[b] / *expected[b] : *found[b] - *expected[b]) /
                                     kThrows);
    };
    add(t30, wave.t30_s, energy.t30_s, true);
    add(t20, wave.t20_s, energy.t20_s, true);
    add(c80_db, wave.c80_db, energy.c80_db, false);
    add(d50, wave.d50, energy.d50, false);
    add(ts_s, wave.ts_s, energy.ts_s, false);
    add(g_db, wave.g_db, energy.g_db, false);
  }
  for (std::size_t b = 0; b < kBandCount; ++b) {
    SCOPED_TRACE(kBandCentres_hz[b]);
    EXPECT_NEAR(t30[b], 1, 0.05);
    EXPECT_NEAR(t20[b], 1, 0.05);
    EXPECT_NEAR(c80_db[b], 0, 1);
    EXPECT_NEAR(d50[b], 0, 0.05);
    EXPECT_NEAR(ts_s[b], 0, 0.005);
    EXPECT_NEAR(g_db[b], 0, 0.5);
  }
}

TEST(RoomParameters, OfAPulseExcludeTheRingingOfFilters) {
  std::vector<float> waveform(48000);
  waveform[480] = 0.1f;
  const RoomParameters found = room_parameters(waveform, same_in_all_bands(0.01f));
  for (std::size_t b = 0; b < kBandCount; ++b) {
    EXPECT_FALSE(found.edt_s[b] || found.t20_s[b] || found.t30_s[b]) << kBandCentres_hz[b];
    EXPECT_NEAR(*found.g_db[b], 0, 1e-6);
    EXPECT_NEAR(*found.d50[b], 1, 1e-6);
    EXPECT_NEAR(*found.ts_s[b], 0, 1e-6);
  }
}

}  // namespace
}  // namespace clamor
