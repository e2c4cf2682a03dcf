// late_boost_test.cpp: energy of an impulse response in steps of 5 ms, of 2000 sources against all
// of them.
#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/engine/auralizer_input.h"
#include "runtime/propagation/late_boost.h"
#include "tests/paper_scenes.h"
#include "tests/sanitized.h"
#include "tools/analysis/sampled_response.h"

namespace clamor {
namespace {

using testing::BakedScene;

constexpr double kStep_s = 0.005;
constexpr std::size_t kSteps = 60, kChosenVoices = 2000;
using Steps = std::array<double, kSteps>;

// Energy per step from the direct sound on, for an impulse, so bands weigh by their width.
Steps steps_of(const std::vector<Arrival>& arrivals, double first_s) {
  const std::vector<Signal> impulse = {{"impulse", {1}, false}};
  static const Bands power = prepare_signals(impulse)[0].mean_square();
  Steps steps{};
  for (const Arrival& arrival : arrivals) {
    const double at = (arrival.time_s - first_s) / kStep_s;
    if (at < 0 || at >= static_cast<double>(kSteps)) continue;
    for (std::size_t b = 0; b < kBandCount; ++b)
      steps[static_cast<std::size_t>(at)] +=
          static_cast<double>(power[b]) * static_cast<double>(arrival.energy[b]);
  }
  return steps;
}

// Root mean square of the level errors; an empty step counts as 20 dB.
double rms_db(const Steps& steps, const Steps& all) {
  double squares = 0;
  for (std::size_t i = 0; i < kSteps; ++i) {
    const double db = steps[i] > 0 ? 10 * std::log10(steps[i] / all[i]) : -20;
    squares += db * db / kSteps;
  }
  return std::sqrt(squares);
}

// Errors over several places and several draws of the sources' u.
struct StepErrors {
  double rms_db = 0, worst_db = 0;  // over all places; of the worst place
};

StepErrors errors_of(BakedScene& scene, const LateBoost& late_boost, std::uint64_t rolls = 5) {
  const AuralizerInput& input = scene.input;
  const Emitter& violin = input.emitters[0];
  const auto scattered = scene.places();
  const std::vector<Vec3> places = {violin.position_m + 4.0 * violin.axis, scattered[0],
                                    scattered[7], scattered[13]};
  StepErrors errors;
  double squares = 0;
  for (const Vec3& place : places) {
    const auto respond = [&](const StrategyOptions& options) {
      return sampled_response(options, input.sources, input.emitters, input.materials, input.air,
                              place, 0, late_boost);
    };
    const auto all = respond({"all", 0, Estimator::kPower, {}});
    const Steps truth = steps_of(all, all.front().time_s);
    double of_place = 0;
    for (std::uint64_t roll = 1; roll <= rolls; ++roll) {
      const std::vector<float> u = testing::rolled_u(roll, scene.size());
      for (std::size_t i = 0; i < scene.size(); ++i) scene.input.sources[i].u = u[i];
      const auto sampled = respond({"priority", kChosenVoices, Estimator::kPower, {}});
      EXPECT_LE(sampled.size(), kChosenVoices);
      of_place += std::pow(rms_db(steps_of(sampled, all.front().time_s), truth), 2) /
                  static_cast<double>(rolls);
    }
    squares += of_place / static_cast<double>(places.size());
    errors.worst_db = std::max(errors.worst_db, std::sqrt(of_place));
  }
  errors.rms_db = std::sqrt(squares);
  return errors;
}

TEST(LateBoost, IsZeroWithoutADecayGrowsWithTheDelayAndIsBounded) {
  EXPECT_EQ(LateBoost().at(1), 0);
  EXPECT_EQ(LateBoost(DecaySummary{}, 1000).at(1), 0);
  for (const double t60_s : {1e-6, 0.05, 0.6, 3.0, 100.0}) {
    const LateBoost boost(t60_s);
    EXPECT_EQ(boost.at(0), 0);
    for (float delay_s = 0; delay_s < 0.4f; delay_s += 0.0004f)
      ASSERT_LE(boost.at(delay_s), boost.at(delay_s + 0.0004f));
    EXPECT_LT(boost.at(1e30f), LateBoost::kMaxBoost);
    EXPECT_EQ(boost.at(1e30f), boost.at(LateBoost::kUntil_s));
  }
  // The value follows the formula at a step of the table: r = 25.33 / s.
  EXPECT_NEAR(LateBoost(0.6).at(0.1f), 0.5 * (std::exp(2.5328) - 1) / 7.5985, 1e-4);
  // The boost depends on the sources that arrive as late as this, not on all of them.
  const DecaySummary decay = {4, {0, 0, 0, 0, 0, 0.6f, 0.6f, 0.6f}, {}, 0.1f};
  EXPECT_NEAR(LateBoost(decay, 200'000).at(0.1f) / LateBoost(0.6).at(0.1f), 1, 1e-5);
  EXPECT_NEAR(LateBoost(decay, 1'000'000).at(0.1f) / LateBoost(0.6).at(0.1f), 1.0 / 16, 1e-5);
  EXPECT_EQ(LateBoost::strength(1000), 0.5f);
  EXPECT_EQ(LateBoost::strength(2000), 1);
  EXPECT_EQ(LateBoost::strength(8000), 0.25f);
}

TEST(LateBoost, KeepsTheEnergyOfEvery5MsWithin1DbOver300Ms_NoAsan) {
  for (const float exponent : {20.0f, 100.0f}) {
    const auto scene = BakedScene::baked("violin_room.glb", 50'000, exponent);
    const StepErrors with =
        errors_of(*scene, LateBoost(scene->input.decay, scene->input.sources.size()));
    const StepErrors without = errors_of(*scene, LateBoost());
    const auto record = [&](const char* what, double db) {
      RecordProperty(what + std::to_string(static_cast<int>(exponent)),
                     static_cast<int>(std::lround(1000 * db)));
    };
    record("millidecibels_of_exponent_", with.rms_db);
    record("without_boost_of_exponent_", without.rms_db);
    EXPECT_LT(with.rms_db, 1) << exponent;
    EXPECT_LT(with.worst_db, 1) << exponent;
    // The test is sensitive: without the boost the error is larger.
    EXPECT_GT(without.rms_db, 2 * with.rms_db) << exponent;
  }
}

TEST(LateBoost, KeepsItWithAsManySourcesAsABakeHas) {
  if (testing::kSanitized) GTEST_SKIP() << "the same code as with fewer sources, in half a minute";
  const auto scene = BakedScene::baked("violin_room.glb", 200'000, 100);
  const StepErrors with =
      errors_of(*scene, LateBoost(scene->input.decay, scene->input.sources.size()), 3);
  RecordProperty("millidecibels", static_cast<int>(std::lround(1000 * with.rms_db)));
  EXPECT_LT(with.rms_db, 1);
}

}  // namespace
}  // namespace clamor
