#include "tools/analysis/sound_comparison.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "tests/tools/analysis/test_sounds.h"
#include "tools/analysis/time_varying_part.h"

namespace clamor {
namespace {

using testing::decaying;
using testing::later;
using testing::mono;
using testing::noise;
using testing::plus;
using testing::sine;
using testing::stereo;
using testing::times;

constexpr auto kAsProgramme = SoundKind::kProgramme;
constexpr auto kResponse = SoundKind::kImpulseResponse;

const Difference& find(const std::vector<Difference>& differences, Measure measure) {
  for (const Difference& difference : differences)
    if (difference.info->measure == measure) return difference;
  ADD_FAILURE() << "not measured: " << kMeasures[static_cast<std::size_t>(measure)].key;
  return differences.front();
}

double worst(const std::vector<Difference>& differences, Measure measure) {
  const DifferencePoint* const point = find(differences, measure).worst();
  return point == nullptr ? NAN : *point->difference;
}

std::vector<Difference> compare_sounds(const Sound& a, const Sound& b,
                                       SoundKind kind = kAsProgramme) {
  return compare(analyse(a, kind), analyse(b, kind));
}

std::set<std::string> audible_in(const std::vector<Difference>& differences) {
  std::set<std::string> keys;
  for (const Difference& difference : differences)
    if (difference.audible()) keys.insert(difference.info->key);
  return keys;
}

TEST(Measures, AreListedInOrderEachWithASource) {
  std::set<std::string> keys;
  for (std::size_t i = 0; i < kMeasures.size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(kMeasures[i].measure), i);
    EXPECT_GT(std::string(kMeasures[i].source).size(), 5u) << kMeasures[i].key;
    EXPECT_FALSE(std::string(kMeasures[i].jnd_source).empty()) << kMeasures[i].key;
    keys.insert(kMeasures[i].key);
  }
  EXPECT_EQ(keys.size(), kMeasures.size());
}

TEST(Comparison, OfASoundWithItselfFindsNothing) {
  const auto left = noise(1, 0.1, 2), early = decaying(1, 0.5, 1);
  const Sound sound = stereo(left, plus(left, noise(2, 0.1, 2)));
  const Sound response = stereo(early, plus(early, decaying(2, 0.5, 1)));
  for (const auto& differences :
       {compare_sounds(sound, sound), compare_sounds(response, response, kResponse)})
    for (const Difference& difference : differences) {
      EXPECT_FALSE(difference.audible()) << difference.info->key;
      const auto* const point = difference.worst();
      ASSERT_NE(point, nullptr) << difference.info->key;
      EXPECT_EQ(*point->difference, difference.info->measure == Measure::kCorrelation ? 1 : 0)
          << difference.info->key;
    }
}

TEST(Comparison, OfAGainFindsItInEveryLevelAndNothingElse) {
  const Sound a = stereo(noise(1, 0.1, 3), noise(2, 0.1, 3));
  for (const double gain : {0.5, 1.05, 2.0}) {
    const double gain_db = 20 * std::log10(gain);
    const auto differences =
        compare_sounds(a, stereo(times(a.channels[0], gain), times(a.channels[1], gain)));
    for (const Measure level :
         {Measure::kIntegratedLoudness, Measure::kMomentaryLoudness, Measure::kSpectrum})
      for (const DifferencePoint& point : find(differences, level).points)
        EXPECT_NEAR(*point.difference, gain_db, 1e-3);
    for (const Measure none :
         {Measure::kIld, Measure::kItd, Measure::kIacc, Measure::kClicks, Measure::kRenormalisedL2})
      for (const DifferencePoint& point : find(differences, none).points)
        EXPECT_NEAR(point.difference.value_or(0), 0, 1e-3)
            << kMeasures[static_cast<std::size_t>(none)].key;
    EXPECT_NEAR(worst(differences, Measure::kL2), std::abs(gain - 1), 1e-5);
    EXPECT_NEAR(worst(differences, Measure::kCorrelation), 1, 1e-9);
    // 0.4 dB are inaudible, 6 dB are audible.
    EXPECT_EQ(audible_in(differences).empty(), gain == 1.05);
  }
}

TEST(Comparison, OfIndependentNoiseHasTheL2OfTheClosedForm) {
  // |b - a|^2 = |a|^2 + |b|^2, so sqrt 2 at equal level and sqrt(1 + g^2) otherwise.
  const Sound a = mono(noise(1, 0.1, 10)), b = mono(noise(2, 0.2, 10));
  const auto differences = compare_sounds(a, b);
  EXPECT_NEAR(worst(differences, Measure::kL2), std::sqrt(5), 0.01);
  EXPECT_NEAR(worst(differences, Measure::kRenormalisedL2), std::sqrt(2), 0.01);
  // L2^2 = 1 + g^2 - 2 g rho, exactly.
  const double rho = worst(differences, Measure::kCorrelation);
  EXPECT_NEAR(rho, 0, 0.01);
  EXPECT_NEAR(std::pow(worst(differences, Measure::kRenormalisedL2), 2), 2 - 2 * rho, 1e-9);
}

TEST(Comparison, NamesTheBandThatChanged) {
  // A tone as strong as the noise in its ERB adds power around 1 kHz.
  const auto sound = noise(3, 0.1, 8);
  const double band_power = 0.01 * 132.6 / 24000;
  const auto differences =
      compare_sounds(mono(sound), mono(plus(sound, sine(1000, std::sqrt(2 * band_power), 8))));
  const DifferencePoint* const point = find(differences, Measure::kSpectrum).worst();
  EXPECT_NEAR(point->at, 1000, 70);
  EXPECT_NEAR(*point->difference, 10 * std::log10(2), 0.3);
  EXPECT_EQ(audible_in(differences), std::set<std::string>{"spectrum"});
}

TEST(Comparison, NamesTheMomentThatChanged) {
  const auto sound = noise(4, 0.1, 10);
  auto louder = sound;
  for (std::size_t i = 4 * 48000; i < 4 * 48000 + 19200; ++i) louder[i] *= 2;
  const auto differences = compare_sounds(mono(sound), mono(louder));
  const DifferencePoint* const point = find(differences, Measure::kMomentaryLoudness).worst();
  EXPECT_NEAR(point->at, 4.2, 1e-9);  // the middle of the only window that contains all of it
  EXPECT_NEAR(*point->difference, 6.02, 0.1);
}

TEST(Comparison, FindsBinauralChangesAndJudgesThemByTheirOwnJnd) {
  const auto sound = noise(5, 0.1, 5), own = noise(6, 0.1, 5);
  const auto centre = stereo(sound, sound);
  // ITD: one sample is 21 us, more than 10 us at 1 kHz and less than 0.05 rad at 63 Hz.
  const auto delayed = compare_sounds(centre, stereo(sound, later(sound, 1)));
  EXPECT_NEAR(worst(delayed, Measure::kItd), 20.8, 0.5);
  EXPECT_EQ(find(delayed, Measure::kItd).worst()->at, 1000);
  EXPECT_EQ(audible_in(delayed), std::set<std::string>{"itd"});
  EXPECT_LT(std::abs(*find(delayed, Measure::kItd).points[0].difference),
            find(delayed, Measure::kItd).points[0].jnd);
  // ILD: slightly more than half a decibel.
  const auto turned = compare_sounds(centre, stereo(sound, times(sound, std::pow(10, 0.6 / 20))));
  EXPECT_NEAR(worst(turned, Measure::kIld), 0.6, 1e-3);
  EXPECT_EQ(audible_in(turned), std::set<std::string>{"ild"});
  // IACC: 0.8 of the amplitude in common.
  const auto wider =
      compare_sounds(centre, stereo(sound, plus(times(sound, 0.8), times(own, 0.6))));
  EXPECT_NEAR(worst(wider, Measure::kIacc), -0.2, 0.03);
}

TEST(Comparison, OfResponsesSeparatesTheFirst80Milliseconds) {
  // The early sound is the same in both ears; the tail is coherent in A and incoherent in B.
  const auto left = decaying(13, 1, 1.5), own = decaying(14, 1, 1.5);
  auto right = left;
  std::copy(own.begin() + 480 + 3840, own.end(), right.begin() + 480 + 3840);
  const auto differences = compare_sounds(stereo(left, left), stereo(left, right), kResponse);
  // exp(-13.8 x 0.08), a third of the energy, arrives later.
  const double late = std::exp(-6 * std::log(10) * 0.08);
  for (const DifferencePoint& point : find(differences, Measure::kIacc).points)
    if (point.at >= 1000) {
      EXPECT_NEAR(*point.difference, -late, 0.1) << point.at;
    }
  // The direct sound is what lies within 20 dB of an ear's own peak, which the tail may shift.
  EXPECT_NEAR(worst(differences, Measure::kEarlyIacc), 0, 1e-3);
  EXPECT_FALSE(audible_in(differences).contains("iacc_early"));
  EXPECT_TRUE(audible_in(differences).contains("iacc"));
}

TEST(Comparison, CountsOnlyNewClicks) {
  auto a = noise(7, 0.01, 4);
  a[48000] = 1;
  auto b = a;
  b[96000] = 0.8f;
  b[120000] = 0.9f;
  const auto more = compare_sounds(mono(a), mono(b));
  const DifferencePoint* const point = find(more, Measure::kClicks).worst();
  EXPECT_EQ(*point->a, 1);
  EXPECT_EQ(*point->b, 3);
  EXPECT_EQ(*point->difference, 2);
  EXPECT_NEAR(point->at, 2.5, 1e-3);  // the largest
  EXPECT_TRUE(find(more, Measure::kClicks).audible());
  EXPECT_FALSE(find(compare_sounds(mono(b), mono(a)), Measure::kClicks).audible());
}

TEST(Comparison, JudgesTextureStatisticsByChance) {
  const auto dense = noise(15, 0.0125, 4), other = noise(16, 0.0125, 4);
  std::vector<float> sparse(dense.size());
  for (std::size_t i = 800; i < sparse.size(); i += 1600)
    sparse[i] = i / 1600 % 3 == 0 ? 0.5f : -0.5f;
  const auto by_chance = compare_sounds(mono(dense), mono(other));
  const auto grainy = compare_sounds(mono(dense), mono(sparse));
  for (const Measure measure : {Measure::kEnvelopeVariation, Measure::kEnvelopeSkewness,
                                Measure::kModulation, Measure::kBandCorrelation}) {
    const double chance = find(by_chance, measure).size();
    EXPECT_GT(chance, 0);
    EXPECT_GT(find(grainy, measure).size(), 2 * chance)
        << kMeasures[static_cast<std::size_t>(measure)].key;
    EXPECT_TRUE(find(grainy, measure).beyond_chance(2 * chance));
    EXPECT_FALSE(find(by_chance, measure).beyond_chance(2 * chance));
    EXPECT_FALSE(find(grainy, measure).audible());
  }
  EXPECT_FALSE(find(grainy, Measure::kL2).beyond_chance(0));
}

TEST(Comparison, OfDecaysFindsTheirClosedForms) {
  // Both sounds are the same noise; only their envelopes differ.
  constexpr double kA_s = 1.0, kB_s = 1.2;
  const auto differences =
      compare_sounds(mono(decaying(8, kA_s, 1.5)), mono(decaying(8, kB_s, 1.5)), kResponse);
  const auto rate = [](double decay_s) { return 6 * std::log(10) / decay_s; };
  // Means over the octaves from 500 Hz, because single octaves vary by chance.
  const auto mean = [&](Measure measure) {
    double sum = 0;
    for (const DifferencePoint& point : find(differences, measure).points)
      if (point.at >= 500) sum += *point.difference / 5;
    return sum;
  };
  for (const Measure decay : {Measure::kEdt, Measure::kT20, Measure::kT30})
    EXPECT_NEAR(mean(decay), 20, 2);
  const auto c80_db = [&](double decay_s) {
    const double left = std::exp(-rate(decay_s) * 0.08);
    return 10 * std::log10((1 - left) / left);
  };
  EXPECT_NEAR(mean(Measure::kC80), c80_db(kB_s) - c80_db(kA_s), 0.15);
  EXPECT_NEAR(mean(Measure::kD50), std::exp(-rate(kA_s) * 0.05) - std::exp(-rate(kB_s) * 0.05),
              0.01);
  EXPECT_NEAR(mean(Measure::kTs), 1e3 / rate(kB_s) - 1e3 / rate(kA_s), 1);
  EXPECT_NEAR(mean(Measure::kG), 10 * std::log10(kB_s / kA_s), 0.15);
  // The curves diverge linearly: where A is at -35 dB, B is at -35 dB / 1.2.
  EXPECT_NEAR(mean(Measure::kDecayCurve), 35 - 35 / 1.2, 0.4);
  EXPECT_NEAR(mean(Measure::kEchoDensity), 0, 0.03);
  EXPECT_TRUE(audible_in(differences).contains("t30"));
  EXPECT_FALSE(audible_in(differences).contains("echo_density"));
}

TEST(Comparison, OfResponsesFindsSparseEchoesInPlaceOfATail) {
  // 100 arrivals per second with the energy of the noise that they replace.
  const auto dense = decaying(9, 1.0, 1.5);
  std::vector<float> sparse(dense.size());
  for (std::size_t i = 480; i < sparse.size(); i += 480) {
    double energy = 0;
    for (std::size_t k = i; k < std::min(i + 480, dense.size()); ++k)
      energy += static_cast<double>(dense[k]) * dense[k];
    sparse[i] = static_cast<float>(i / 480 % 3 == 0 ? -std::sqrt(energy) : std::sqrt(energy));
  }
  const auto differences = compare_sounds(mono(dense), mono(sparse), kResponse);
  EXPECT_TRUE(find(differences, Measure::kEchoDensity).audible());
  const auto& points = find(differences, Measure::kEchoDensity).points;
  ASSERT_EQ(points.size(), 5u);
  // At 8 kHz an echo rings for 0.3 of its 10 ms; noise has a density of 1.
  EXPECT_NEAR(*points[4].a, 1, 0.05);
  EXPECT_LT(*points[4].b, 0.35);
}

TEST(Comparison, OfResponsesMistakesNoDelayForADecay) {
  const auto response = decaying(10, 0.6, 1);
  const auto differences = compare_sounds(mono(response), mono(later(response, 700)), kResponse);
  for (const Measure measure : {Measure::kEdt, Measure::kT30, Measure::kC80, Measure::kTs,
                                Measure::kG, Measure::kDecayCurve, Measure::kEchoDensity})
    EXPECT_NEAR(worst(differences, measure), 0, 0.02)
        << kMeasures[static_cast<std::size_t>(measure)].key;
  EXPECT_NEAR(worst(differences, Measure::kL2), std::sqrt(2), 0.2);
}

TEST(Comparison, TreatsTheShorterSoundAsSilentAfterItsEnd) {
  const auto sound = noise(11, 0.1, 4);
  const Sound cut = mono({sound.begin(), sound.begin() + 2 * 48000});
  const auto differences = compare_sounds(mono(sound), cut);
  EXPECT_NEAR(worst(differences, Measure::kL2), std::sqrt(0.5), 0.01);
  EXPECT_NEAR(worst(differences, Measure::kMomentaryLoudness), -40, 0.5);  // down to the floor
}

TEST(Comparison, OfSilenceIsDefined) {
  const Sound silence = mono(std::vector<float>(96000)), sound = mono(noise(12, 0.1, 2));
  for (const SoundKind kind : {kAsProgramme, kResponse}) {
    for (const Difference& difference : compare_sounds(silence, silence, kind))
      EXPECT_FALSE(difference.audible()) << difference.info->key;
    EXPECT_NEAR(worst(compare_sounds(silence, sound, kind), Measure::kSpectrum), 60, 1e-6);
    EXPECT_NEAR(worst(compare_sounds(sound, silence, kind), Measure::kSpectrum), -60, 1e-6);
  }
  const auto lost = compare_sounds(sound, silence);
  EXPECT_LT(worst(lost, Measure::kIntegratedLoudness), -40);
  EXPECT_EQ(worst(lost, Measure::kL2), 1);
  EXPECT_TRUE(std::isnan(worst(compare_sounds(silence, sound), Measure::kL2)));
  const Sound one_sample = mono({0.5f});
  EXPECT_TRUE(audible_in(compare_sounds(one_sample, one_sample)).empty());
  EXPECT_TRUE(audible_in(compare_sounds(one_sample, one_sample, kResponse)).empty());
}

TEST(SoundKind, IsAResponseIfTheSoundStartsAtOnceAndDecays) {
  EXPECT_TRUE(looks_like_impulse_response(mono(decaying(1, 0.5, 1))));
  EXPECT_TRUE(looks_like_impulse_response(stereo(decaying(1, 2, 3), decaying(2, 2, 3))));
  std::vector<float> click(48000);
  click[100] = 1;
  EXPECT_TRUE(looks_like_impulse_response(mono(click)));
  EXPECT_FALSE(looks_like_impulse_response(mono(noise(1, 0.1, 1))));
  EXPECT_FALSE(looks_like_impulse_response(mono(decaying(1, 5, 1))));
  EXPECT_FALSE(looks_like_impulse_response(mono(testing::swelling(noise(1, 0.1, 1)))));
  EXPECT_FALSE(looks_like_impulse_response(mono(std::vector<float>(1000))));
  EXPECT_FALSE(looks_like_impulse_response(mono({})));
}

}  // namespace
}  // namespace clamor
