// strategies_loudness_test.cpp: level of a sample and error of its waveform in the paper's two
// scenes. Only powers are summed, as for incoherent sounds.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "runtime/propagation/source_weight.h"
#include "runtime/sampling/sampler.h"
#include "tests/paper_scenes.h"
#include "tests/sanitized.h"

namespace clamor {
namespace {

using testing::BakedScene;

constexpr std::size_t kPlaceStep = testing::kSanitized ? 12 : 6;       // of twenty
constexpr std::size_t kSlopePlaceStep = testing::kSanitized ? 12 : 3;  // for a mean over places

class PaperScene : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (testing::kSanitized && std::string(GetParam()) == "stadium_paper.glb")
      GTEST_SKIP() << "the same code as in the violin room";
  }

  // Bakes a scene at its first use.
  const BakedScene& scene(std::uint64_t seed = 1) const {
    static std::map<std::pair<std::string, std::uint64_t>, std::unique_ptr<BakedScene>> scenes;
    auto& scene = scenes[{GetParam(), seed}];
    if (scene == nullptr) scene = BakedScene::baked(GetParam(), 10000, 0, seed);
    return *scene;
  }

  // One bake decides how an octree divides the sources: of eight bakes of the violin room, two give
  // a slope that is more than 0.06 off, and three a place that is more than 6 dB too loud.
  static constexpr std::uint64_t kBakes = 4;
};

// Waveform of a sample of incoherent sounds: the sums of S^2 A^2 and of S A^2.
struct Waveform {
  double power = 0, product = 0;  // relative to those of all sources
  double l2() const { return std::sqrt(std::max(0.0, 1 - 2 * product + power)); }
  double renormalised_l2() const { return std::sqrt(2 - 2 * product / std::sqrt(power)); }
};

struct Levels {
  double loudness_db = 0;
  std::array<double, kBandCount> bands_db{};
  Waveform waveform;
};

// Priority sampling by its definition; priority_sampler_test.cpp compares the sampler with a
// definition as well.
class PlacedScene {
 public:
  PlacedScene(const BakedScene& scene, const Vec3& place) {
    const Bands loudness = loudness_weights();
    for (std::uint32_t i = 0; i < scene.size(); ++i) {
      const Bands power = scene.received(i, place);
      double weight = 0;
      for (std::size_t b = 0; b < kBandCount; ++b)
        weight += static_cast<double>(loudness[b]) * power[b];
      if (weight == 0) continue;
      const float late = scene.radiation.late_boost().at(scene.input.sources[i].delay_s);
      sources_.push_back({weight, power, late, i});
      whole_ += weight;
      for (std::size_t b = 0; b < kBandCount; ++b) bands_[b] += power[b];
    }
  }

  Levels sampled(std::size_t k, const std::vector<float>& u) const {
    std::vector<std::pair<double, std::uint32_t>> priorities;
    priorities.reserve(sources_.size());
    for (std::uint32_t i = 0; i < sources_.size(); ++i)
      priorities.emplace_back(sources_[i].boosted(k) / u[sources_[i].number], i);
    const auto last = priorities.begin() + static_cast<std::ptrdiff_t>(k);
    std::nth_element(priorities.begin(), last, priorities.end(), std::greater<>());
    double loudness = 0, product = 0;
    std::array<double, kBandCount> bands{};
    for (auto p = priorities.begin(); p != last; ++p) {
      const auto& source = sources_[p->second];
      const double scale = std::max(1.0, last->first / source.boosted(k));
      loudness += scale * source.weight;
      product += std::sqrt(scale) * source.weight;
      for (std::size_t b = 0; b < kBandCount; ++b) bands[b] += scale * source.power[b];
    }
    Levels levels;
    levels.waveform = {loudness / whole_, product / whole_};
    levels.loudness_db = 10 * std::log10(loudness / whole_);
    for (std::size_t b = 0; b < kBandCount; ++b)
      levels.bands_db[b] = 10 * std::log10(bands[b] / bands_[b]);
    return levels;
  }

 private:
  struct WeightedPower {
    double weight;
    Bands power;
    float late;
    std::uint32_t number;
    double boosted(std::size_t k) const {
      return weight * static_cast<double>(1 + LateBoost::strength(k) * late);
    }
  };
  std::vector<WeightedPower> sources_;
  double whole_ = 0;
  std::array<double, kBandCount> bands_{};
};

TEST_P(PaperScene, IsWithinTheLevelToleranceByPriorityIn95Of100Bakes) {
  constexpr std::size_t kRolls = 100, kPlaces = 20;
  std::vector<PlacedScene> placed;
  for (const Vec3& place : scene().places()) placed.emplace_back(scene(), place);
  ASSERT_EQ(placed.size(), kPlaces);
  for (const auto& [k, limit_db] : {std::pair<std::size_t, double>{150, 0.8}, {2000, 0.2}}) {
    double squares = 0;
    std::vector<int> within(kPlaces);
    std::vector<std::array<int, kBandCount>> band_within(kPlaces);
    for (std::uint64_t roll = 1; roll <= kRolls; ++roll) {
      const std::vector<float> u = testing::rolled_u(roll, scene().size());
      for (std::size_t p = 0; p < kPlaces; ++p) {
        const Levels levels = placed[p].sampled(k, u);
        within[p] += std::abs(levels.loudness_db) <= limit_db;
        squares += levels.loudness_db * levels.loudness_db;
        for (std::size_t b = 0; b < kBandCount; ++b)
          band_within[p][b] += std::abs(levels.bands_db[b]) <= 1;
      }
    }
    for (std::size_t p = 0; p < kPlaces; ++p)
      EXPECT_GE(within[p], 95) << "k = " << k << " at place " << p;
    // The theoretical bound holds over all places and draws.
    const double deviation_db = std::sqrt(squares / (kPlaces * kRolls));
    RecordProperty("deviation_mdb_at_" + std::to_string(k), static_cast<int>(1000 * deviation_db));
    EXPECT_LE(deviation_db, 4.34 / std::sqrt(static_cast<double>(k) - 1));
    if (k < 2000) continue;
    for (std::size_t p = 0; p < kPlaces; ++p)
      for (std::size_t b = 0; b < kBandCount; ++b)
        EXPECT_GE(band_within[p][b], 95) << kBandCentres_hz[b] << " Hz at place " << p;
  }
}

class Waveforms {
 public:
  Waveforms(const BakedScene& scene, const Vec3& place)
      : scene_(scene), place_(place), list_(scene.radiation, scene.weights, scene.input.sources) {
    for (std::size_t i = 0; i < scene.size(); ++i) {
      powers_.push_back(weight(
          scene.radiation, scene.weights.by_signal[scene.radiation.signal(scene.input.sources[i])],
          scene.input.sources[i], place));
      whole_ += powers_.back();
    }
  }

  Waveform of(const std::string& strategy, std::size_t k, Estimator estimator,
              std::uint64_t seed = 1) {
    StrategyOptions options{strategy, k, estimator, {}};
    options.tuning.seed = seed;
    const auto sampler = make_sampler(options, scene_.radiation, scene_.weights, list_);
    Waveform waveform;
    for (const SampledSource& chosen : sampler->sample(place_)) {
      waveform.power += chosen.power_scale * powers_[chosen.number] / whole_;
      waveform.product += std::sqrt(chosen.power_scale) * powers_[chosen.number] / whole_;
    }
    return waveform;
  }

  // Number of sources with equal amplitudes that would have the same ratio of sums (N_eff).
  double effective() const {
    double amplitudes = 0;
    for (const double power : powers_) amplitudes += std::sqrt(power);
    return amplitudes * amplitudes / whole_;
  }

  // Sum of the squared shares of the total power: the inverse of the number of equally loud
  // sources.
  double concentration() const {
    double squares = 0;
    for (const double power : powers_) squares += std::pow(power / whole_, 2);
    return squares;
  }

 private:
  const BakedScene& scene_;
  const Vec3 place_;
  SourceList list_;
  std::vector<double> powers_;
  double whole_ = 0;
};

// Compared in each draw. For priority sampling a draw is a bake with other random numbers u.
TEST_P(PaperScene, HasASmallerErrorByPriorityThanByAnyStrategyOfThePaper) {
  for (std::size_t p = 0; p < 20; p += kPlaceStep) {
    Waveforms waveforms(scene(), scene().places()[p]);
    const PlacedScene placed(scene(), scene().places()[p]);
    for (std::size_t k = 128; k <= scene().size() / 2; k *= 2)
      for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        const std::vector<float> u = testing::rolled_u(seed, scene().size());
        const double ours = placed.sampled(k, u).waveform.renormalised_l2();
        for (const StrategyInfo& info : kStrategies) {
          if (*info.section == '\0') continue;
          EXPECT_LT(ours, waveforms.of(info.name, k, Estimator::kAmplitude, seed).renormalised_l2())
              << info.name << " at k = " << k << ", place " << p << ", seed " << seed;
        }
      }
  }
}

// Exponent by which the error falls between samples of most / 16 and `most`; the mean of some
// draws.
double slope_of(Waveforms& waveforms, const char* strategy, std::size_t most) {
  constexpr std::uint64_t kSeeds = 5;
  double low = 0, high = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    low += waveforms.of(strategy, most / 16, Estimator::kAmplitude, seed).l2();
    high += waveforms.of(strategy, most, Estimator::kAmplitude, seed).l2();
  }
  return std::log(high / low) / std::log(static_cast<double>(most) / (most / 16));
}

// Drawing without replacement in proportion to amplitude follows equation 3. The slope of the
// octree, for which the paper reports it, depends on place and bake; only its mean follows.
TEST_P(PaperScene, ReproducesThePapersErrorThatFallsWithTheRootOfTheSample) {
  double octree_slope = 0;
  int slopes = 0;
  for (std::uint64_t bake = 1; bake <= kBakes; ++bake)
    for (std::size_t p = 0; p < 20; p += kSlopePlaceStep) {
      Waveforms waveforms(scene(bake), scene(bake).places()[p]);
      // The range ends where many sources become certain or k is not small against N_eff.
      const auto most = static_cast<std::size_t>(waveforms.effective() / 10);
      if (most / 16 < 8) continue;
      // The choice of these does not depend on how an octree divides the bake.
      if (bake == 1) {
        for (const char* strategy : {"importance", "full-resampling"})
          EXPECT_NEAR(slope_of(waveforms, strategy, most), -0.5, 0.05)
              << strategy << " at place " << p;
      }
      octree_slope += slope_of(waveforms, "octree", most);
      ++slopes;
    }
  ASSERT_GE(slopes, (testing::kSanitized ? 2 : 4) * kBakes);
  EXPECT_NEAR(octree_slope / slopes, -0.5, 0.06);
}

// The mean of ten draws.
double level_difference_db(Waveforms& waveforms, const char* strategy, std::size_t k,
                           Estimator estimator) {
  double power = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed)
    power += waveforms.of(strategy, k, estimator, seed).power / 10;
  return 10 * std::log10(power);
}
double expected_db(double effective, std::size_t k) {
  return 10 * std::log10(1 + effective / static_cast<double>(k));
}

TEST_P(PaperScene, IsTooLoudByThePaperAsItsScaledAmplitudesPredict) {
  for (std::size_t p = 0; p < 20; p += kPlaceStep) {
    Waveforms waveforms(scene(), scene().places()[p]);
    const double effective = waveforms.effective();
    for (const double share : {0.005, 0.02, 0.08}) {
      const auto k = static_cast<std::size_t>(share * effective);
      SCOPED_TRACE(::testing::Message() << "k = " << k << " of " << effective << ", place " << p);
      for (const char* strategy : {"importance", "full-resampling"}) {
        // No source is drawn twice, which removes k of N_eff: 0.35 dB at 8 %.
        EXPECT_NEAR(level_difference_db(waveforms, strategy, k, Estimator::kAmplitude),
                    expected_db(effective, k), 0.5)
            << strategy;
        EXPECT_NEAR(level_difference_db(waveforms, strategy, k, Estimator::kPower), 0, 0.05)
            << strategy;
      }
    }
  }
}

// A representative has the radiation of its node, regardless of what reaches the listener.
TEST_P(PaperScene, IsLouderStillByTheOctreeOfThePaper) {
  for (std::size_t p = 0; p < 20; p += kPlaceStep) {
    double more_db = 0;
    for (std::uint64_t bake = 1; bake <= kBakes; ++bake) {
      Waveforms waveforms(scene(bake), scene(bake).places()[p]);
      const double effective = waveforms.effective();
      const auto k = static_cast<std::size_t>(0.08 * effective);
      more_db += (level_difference_db(waveforms, "octree", k, Estimator::kAmplitude) -
                  expected_db(effective, k)) /
                 kBakes;
    }
    EXPECT_GT(more_db, 3) << "place " << p;
    EXPECT_LT(more_db, 6) << "place " << p;
  }
}

// Uniform draws scale a source by n / k, and the mean square error is n / k - 1, which falls with
// the root of the sample, too. A hundred draws are needed.
TEST_P(PaperScene, IsTooLoudByUniformDrawsByTheirScale) {
  constexpr std::uint64_t kSeeds = testing::kSanitized ? 60 : 100;
  const auto n = static_cast<double>(scene().size());
  for (std::size_t p = 0; p < 20; p += kPlaceStep) {
    Waveforms waveforms(scene(), scene().places()[p]);
    for (const std::size_t k : {100u, 400u, 1600u}) {
      const double stands_for = n / static_cast<double>(k);
      double power = 0, error = 0;
      for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        const Waveform drawn = waveforms.of("random", k, Estimator::kAmplitude, seed);
        power += drawn.power / kSeeds;
        error += std::pow(drawn.l2(), 2) / kSeeds;
      }
      // Four standard errors of the mean.
      const double off = 4 * std::sqrt(stands_for * waveforms.concentration() / kSeeds);
      EXPECT_NEAR(power / stands_for, 1, off) << "k = " << k << " at place " << p;
      EXPECT_NEAR(error / (stands_for - 1), 1, off) << "k = " << k << " at place " << p;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Both, PaperScene,
                         ::testing::Values("stadium_paper.glb", "violin_room.glb"),
                         [](const auto& one) {
                           return std::string(one.param) == "stadium_paper.glb" ? "Stadium"
                                                                                : "Violin";
                         });

}  // namespace
}  // namespace clamor
