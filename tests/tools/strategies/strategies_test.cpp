// strategies_test.cpp: all strategies in one room: size of the sample, bias, and reproducibility.
#include "tools/strategies/strategies.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "common/random.h"
#include "runtime/engine/auralizer_options.h"
#include "runtime/engine/auralizer_statistics.h"
#include "runtime/voices/keyframe.h"
#include "tests/runtime/weighted_room.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

constexpr std::size_t kVoices = 100;
const Vec3 kPlace(4, 5, 1.6);

struct StrategyRoom : testing::WeightedRoom {
  StrategyRoom() : WeightedRoom(150), all(std::make_unique<SourceList>(list())) {}
  std::size_t size() const { return sources().size(); }
  std::unique_ptr<Sampler> sampler(const std::string& strategy, Estimator estimator,
                                   std::uint64_t seed = 1) const {
    StrategyOptions options{strategy, kVoices, estimator, {}};
    options.tuning.seed = seed;
    return make_sampler(options, radiation, weights, *all);
  }

  const std::unique_ptr<SourceList> all;
};

std::vector<std::string> paper_strategies() {
  std::vector<std::string> names;
  for (const StrategyInfo& info : kStrategies)
    if (*info.section != '\0') names.emplace_back(info.name);
  return names;
}

Vec3 walked(int keyframe) { return {1 + 0.03 * keyframe, 2 + 0.04 * keyframe, 1.5}; }

TEST(Strategies, DrawTheRequestedNumberWithoutRepetition) {
  const StrategyRoom room;
  ASSERT_GT(room.size(), 10 * kVoices);
  for (const std::string& name : paper_strategies()) {
    const auto sampler = room.sampler(name, Estimator::kPower);
    for (int keyframe = 0; keyframe < 60; ++keyframe) {
      const auto sample = sampler->sample(walked(keyframe));
      std::set<std::uint64_t> numbers;
      for (const SampledSource& chosen : sample) {
        numbers.insert(chosen.number);
        EXPECT_GE(chosen.power_scale, 0);
        EXPECT_TRUE(std::isfinite(chosen.power_scale));
      }
      EXPECT_EQ(numbers.size(), sample.size()) << name;
      EXPECT_LE(sample.size(), kVoices) << name;
      EXPECT_GE(sample.size(), name == "octree" ? kVoices - 6 : kVoices) << name;
    }
    EXPECT_EQ(sampler->capacity(), kVoices);
  }
}

TEST(Strategies, DrawTheSameForTheSameSeed) {
  const StrategyRoom room;
  for (const std::string& name : paper_strategies()) {
    const auto a = room.sampler(name, Estimator::kAmplitude),
               b = room.sampler(name, Estimator::kAmplitude),
               other = room.sampler(name, Estimator::kAmplitude, 2);
    bool differs = false;
    for (int keyframe = 0; keyframe < 30; ++keyframe) {
      const auto of_a = a->sample(walked(keyframe)), of_b = b->sample(walked(keyframe)),
                 of_other = other->sample(walked(keyframe));
      ASSERT_EQ(of_a.size(), of_b.size());
      differs = differs || of_a.size() != of_other.size();
      for (std::size_t i = 0; i < of_a.size(); ++i) {
        ASSERT_EQ(of_a[i].number, of_b[i].number) << name;
        ASSERT_EQ(of_a[i].power_scale, of_b[i].power_scale) << name;
        differs = differs || of_a[i].number != of_other[i].number;
      }
    }
    EXPECT_TRUE(differs) << name;
  }
}

// At a constant time each source's power, or amplitude, is unbiased. The strategies do not draw by
// the tested sum: one band of every third source.
TEST(Strategies, AreUnbiasedInTheirOwnEstimate) {
  const StrategyRoom room;
  constexpr int kSeeds = testing::kSanitized ? 60 : 200;
  for (const Estimator estimator : {Estimator::kPower, Estimator::kAmplitude})
    for (const std::string& name : paper_strategies()) {
      const auto value = [&](const Source& source, std::size_t number) {
        if (source.is_emitter || number % 3 != 0) return 0.0;
        const Bands intensity = room.radiation.intensity(source, kPlace);
        const double power = intensity[6];
        return estimator == Estimator::kPower ? power : std::sqrt(power);
      };
      double whole = 0;
      for (std::size_t i = 0; i < room.size(); ++i) whole += value(room.sources()[i], i);
      double sum = 0, squares = 0;
      for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        double estimate = 0;
        const auto sampler = room.sampler(name, estimator, seed);
        for (const SampledSource& chosen : sampler->sample(kPlace)) {
          const double factor =
              estimator == Estimator::kPower ? chosen.power_scale : std::sqrt(chosen.power_scale);
          estimate += factor * value(*chosen.source, chosen.number) / whole;
        }
        sum += estimate;
        squares += estimate * estimate;
      }
      const double mean = sum / kSeeds, deviation = std::sqrt(squares / kSeeds - mean * mean);
      EXPECT_GT(deviation, 0.005) << name;
      // There are fourteen means; with random seeds one in 27 runs would exceed the bound.
      EXPECT_NEAR(mean, 1, 3 * deviation / std::sqrt(kSeeds)) << name;
    }
}

// Estimating powers, dynamic samples are right at every moment of a walk, not only on average,
// because their sources stand for equal parts of the power.
TEST(Strategies, ByDynamicSamplingHaveTheTotalLevelThroughoutAWalk) {
  const StrategyRoom room;
  for (const std::string name : {"stochastic-diffusion", "adaptive-diffusion"}) {
    const auto sampler = room.sampler(name, Estimator::kPower);
    for (int keyframe = 0; keyframe < 60; ++keyframe) {
      const Vec3 place = walked(keyframe);
      double whole = 0, estimate = 0;
      for (std::size_t i = 0; i < room.size(); ++i) whole += room.weight_of(i, place);
      for (const SampledSource& chosen : sampler->sample(place))
        estimate += chosen.power_scale * room.weight_of(chosen.number, place);
      // Only certain sources are louder than an equal part; a source that has just become loud is
      // missing until the next exchange.
      EXPECT_NEAR(10 * std::log10(estimate / whole), 0, 0.5) << name << " " << keyframe;
    }
  }
}

// Amplitudes scaled by 1 / P make incoherent sounds too loud, by sum A^2 / P over sum A^2. While no
// source is certain this is N_eff / k, close to the 1 + N_eff / k of drawing with replacement.
TEST(Strategies, OfThePaperAreTooLoudOnAmplitudesAsTheirScalePredicts) {
  const StrategyRoom room;
  double amplitudes = 0, powers = 0;
  std::vector<double> all;
  for (std::size_t i = 0; i < room.size(); ++i) {
    const double power = room.weight_of(i, kPlace);
    all.push_back(std::sqrt(power));
    amplitudes += std::sqrt(power);
    powers += power;
  }
  const double effective = amplitudes * amplitudes / powers;
  ASSERT_GT(effective, 2 * kVoices);
  const auto probabilities = inclusion_probabilities(all, kVoices);
  double expected = 0;
  for (std::size_t i = 0; i < room.size(); ++i)
    if (all[i] > 0) expected += all[i] * all[i] / probabilities[i] / powers;
  constexpr int kSeeds = 200;
  double sum = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto sampler = room.sampler("importance", Estimator::kAmplitude, seed);
    for (const SampledSource& chosen : sampler->sample(kPlace))
      sum += chosen.power_scale * room.weight_of(chosen.number, kPlace) / powers / kSeeds;
  }
  EXPECT_NEAR(10 * std::log10(sum / expected), 0, 0.1);
  EXPECT_NEAR(10 * std::log10(sum), 10 * std::log10(1 + effective / kVoices),
              10 * std::log10(1 + kVoices / effective) + 0.5);
}

TEST(Strategies, ByOctreeDiffusionKnowDirectionsAndByTheOctreeDoNot) {
  const StrategyRoom room;
  const Vec3 outside(-0.05, 4, 1.5);
  const auto silent = [&](const std::string& name) {
    const auto sampler = room.sampler(name, Estimator::kPower);
    int count = 0;
    for (const SampledSource& chosen : sampler->sample(outside))
      count += room.weight_of(chosen.number, outside) == 0;
    return count;
  };
  // A listener behind a wall receives nothing that the wall reflects to its other side.
  EXPECT_GT(silent("octree"), 3);
  EXPECT_EQ(silent("octree-diffusion"), 0);
}

TEST(Strategies, RejectInvalidOptionsAndNameAllStrategies) {
  StrategyOptions options;
  options.strategy = "importence";
  const auto wrong = check(options);
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().message.find("the nearest is 'importance'"), std::string::npos);
  for (const StrategyInfo& info : kStrategies)
    EXPECT_NE(wrong.error().message.find(in_quotes(info.name)), std::string::npos);
  const auto refused = [](auto change) {
    StrategyOptions changed;
    change(changed);
    return !check(changed).ok();
  };
  EXPECT_FALSE(refused([](StrategyOptions&) {}));
  EXPECT_TRUE(refused([](StrategyOptions& o) { o.voices = 0; }));
  EXPECT_TRUE(refused([](StrategyOptions& o) { o.tuning.epsilon = 1; }));
  EXPECT_TRUE(refused([](StrategyOptions& o) { o.tuning.epsilon = std::nan(""); }));
  EXPECT_TRUE(refused([](StrategyOptions& o) { o.tuning.exchange_per_s = -0.1; }));
  EXPECT_TRUE(refused([](StrategyOptions& o) { o.tuning.redraw_s = 0.02; }));
  EXPECT_TRUE(refused([](StrategyOptions& o) { o.tuning.candidates_per_voice = 0; }));
}

// The player's own path: from the list of sources through keyframes to samples.
TEST(Strategies, AreAudibleInTheAuralizer) {
  for (const StrategyInfo& info : kStrategies) {
    AuralizerOptions options;
    options.strategy = make_strategy(info.name);
    options.voices = 50;
    auto auralizer = Auralizer::create(testing::baked_room(50), options);
    ASSERT_TRUE(auralizer.ok()) << auralizer.error().message;
    double energy = 0;
    std::vector<float> block(2 * kKeyframeFrames);
    for (int keyframe = 0; keyframe < 20; ++keyframe) {
      while ((*auralizer)->wants_keyframe()) (*auralizer)->make_keyframe({walked(keyframe), 0, 0});
      (*auralizer)->mix(block);
      for (const float sample : block) energy += static_cast<double>(sample) * sample;
    }
    EXPECT_GT(energy, 0) << info.name;
    EXPECT_EQ((*auralizer)->statistics().bad_voices, 0u) << info.name;
  }
}

}  // namespace
}  // namespace clamor
